//! What `calibrate` states of the sonar's echoes.

use serde::Serialize;
use sonarfix::config::EchoParameters;
use sonarfix_batch::echoes::{Cone, Echoes, Oblique, Share, Source, Square};

/// The lines about the echoes, beside what the robot file has of them.
pub fn lines(echoes: &Echoes, file: &EchoParameters) -> Vec<String> {
    let mut lines = Vec::new();
    lines.extend(echoes.square.as_ref().map(|square| of_square(square, file)));
    lines.extend(echoes.oblique.as_ref().map(of_oblique));
    lines.extend(echoes.oblique.as_ref().and_then(consequence));
    lines
}

fn of_square(square: &Square, file: &EchoParameters) -> String {
    let shown = |share: &Share, file: f32| {
        let [value, half] = [share.value, share.half_interval()].map(|share| 100.0 * share);
        format!("{value:.1} ± {half:.1} % (robot file: {:.1} %)", 100.0 * file)
    };
    format!(
        "{} pings at walls square to the sonar: missed {}; long {}; short {}, which here includes objects that are not on the map",
        square.pings,
        shown(&square.missed, file.missed),
        shown(&square.long, file.long),
        shown(&square.short, file.short)
    )
}

fn of_oblique(oblique: &Oblique) -> String {
    let percent = |share: f64| 100.0 * share;
    let cone = oblique.cone.map_or_else(String::new, |Cone { share, half_angle }| {
        let degrees = half_angle.to_degrees();
        format!(", {:.0} % at the nearest point of a cone of ± {degrees:.0}°", percent(share))
    });
    format!(
        "{} echoes at walls 15° to 55° off their normal, {:.0} % of them of the wall: of these {:.0} % at the perpendicular distance, \
         {:.0} % along the axis{cone}",
        oblique.echoes,
        percent(oblique.of_wall),
        percent(oblique.perpendicular),
        percent(oblique.axis)
    )
}

/// What to do if the sonar does not report perpendicular distances.
fn consequence(oblique: &Oblique) -> Option<String> {
    let (what, most) = match oblique.source()? {
        Source::Perpendicular => return None,
        Source::Axis => ("the distance along its axis", "5 deg".to_owned()),
        Source::Cone => {
            let most = format!("{:.0} deg", oblique.cone?.half_angle.to_degrees());
            ("the nearest point of its cone", most)
        }
    };
    Some(format!(
        "this sonar reports {what}, and the localizer expects the perpendicular distance: `half_angle = \"{most}\"` in [echo], and a `cone` \
         that is not larger, keep it from walls that are more oblique"
    ))
}

/// The echoes in SI units.
#[derive(Serialize)]
pub struct Json {
    square: Option<JsonSquare>,
    oblique: Option<JsonOblique>,
}

/// Shares with their deviations.
#[derive(Serialize)]
struct JsonSquare {
    pings: usize,
    missed: [f64; 2],
    short: [f64; 2],
    long: [f64; 2],
}

#[derive(Serialize)]
struct JsonOblique {
    echoes: usize,
    of_wall: f64,
    perpendicular: f64,
    axis: f64,
    /// Share and half-angle.
    cone: Option<[f64; 2]>,
    source: Option<&'static str>,
}

impl Json {
    pub fn of(echoes: &Echoes) -> Self {
        let pair = |share: Share| [share.value, share.deviation];
        Self {
            square: echoes.square.map(|square| JsonSquare {
                pings: square.pings,
                missed: pair(square.missed),
                short: pair(square.short),
                long: pair(square.long),
            }),
            oblique: echoes.oblique.map(|oblique| JsonOblique {
                echoes: oblique.echoes,
                of_wall: oblique.of_wall,
                perpendicular: oblique.perpendicular,
                axis: oblique.axis,
                cone: oblique.cone.map(|cone| [cone.share, cone.half_angle]),
                source: oblique.source().map(|source| match source {
                    Source::Perpendicular => "perpendicular",
                    Source::Axis => "axis",
                    Source::Cone => "cone",
                }),
            }),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const OBLIQUE: Oblique = Oblique {
        echoes: 100,
        of_wall: 0.9,
        perpendicular: 0.1,
        axis: 0.0,
        cone: Some(Cone { share: 0.9, half_angle: 0.262 }),
    };

    #[test]
    fn only_a_sonar_that_is_not_perpendicular_has_a_consequence() {
        let echoes = Echoes { square: None, oblique: Some(OBLIQUE) };
        let shown = lines(&echoes, &EchoParameters::default());
        assert_eq!(shown.len(), 2, "{shown:?}");
        assert!(shown[0].ends_with("90 % at the nearest point of a cone of ± 15°"), "{shown:?}");
        assert!(shown[1].contains("half_angle = \"15 deg\""), "{shown:?}");
        let usual = Oblique { perpendicular: 1.0, cone: None, ..OBLIQUE };
        let shown =
            lines(&Echoes { square: None, oblique: Some(usual) }, &EchoParameters::default());
        assert_eq!(shown.len(), 1, "{shown:?}");
        let share = Share { value: 0.03, deviation: 0.01 };
        let square = Square { pings: 200, missed: share, short: share, long: share };
        let shown =
            lines(&Echoes { square: Some(square), oblique: None }, &EchoParameters::default());
        assert!(shown[0].contains("missed 3.0 ± 2.0 %"), "{shown:?}");
    }
}
