//! `sonarfix map check --starts`: what a map leads to when a robot starts anywhere on it without a pose.

use std::path::{Path, PathBuf};

use sonarfix_map::{MapFile, Scenario, robot_file};
use sonarfix_plan::anywhere::{
    Anywhere, Confusion, FURNITURE, Landmarks, Outcome, Settings, Start, Times,
};
use sonarfix_plan::bare;
use sonarfix_report::Table;
use sonarfix_report::starts_map::{Dot, StartsMap};
use sonarfix_terminal::output::check_file;
use sonarfix_terminal::progress::Runs;

/// Confusions that are printed.
const SHOWN: usize = 5;

#[derive(Debug, clap::Args)]
pub struct Args {
    /// Starts the robot without a pose at so many random places, and reports how long it takes to find its pose, which places it
    /// confuses, and which board would help.
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(1..))]
    starts: Option<u32>,
    /// With --starts, the longest time of a start.
    #[arg(long, value_name = "SECONDS", default_value_t = 60.0, requires = "starts")]
    seconds: f64,
    /// With --starts, the pieces of furniture on 10 m² that the map does not have.
    #[arg(long, value_name = "PIECES", default_value_t = FURNITURE, requires = "starts")]
    furniture: f64,
    /// With --starts, the seed of the first one; the others count up from it.
    #[arg(long, default_value_t = 0, requires = "starts")]
    seed: u64,
    /// With --starts, draws them on the map.
    #[arg(long, value_name = "FILE.svg", requires = "starts")]
    out: Option<PathBuf>,
}

impl Args {
    /// Checks the options, before anything is computed.
    pub fn check(&self) -> anyhow::Result<()> {
        let is_time = self.seconds > 0.0 && self.seconds.is_finite();
        anyhow::ensure!(is_time, "--seconds must be a number above zero");
        let is_number = (0.0..=100.0).contains(&self.furniture);
        anyhow::ensure!(is_number, "--furniture must be from 0 to 100 pieces on 10 m²");
        self.out.as_deref().map_or(Ok(()), |out| check_file("--out", out))
    }

    /// The forecast, drawn if it is to be.
    pub fn forecast(
        &self,
        map: &MapFile,
        robot: Option<&Path>,
    ) -> anyhow::Result<Option<Forecast>> {
        let Some(starts) = self.starts else { return Ok(None) };
        let Self { seconds, furniture, seed, .. } = *self;
        let settings = Settings { starts, seconds, seed, furniture };
        let scenario = scenario(map, robot)?;
        let path = map.scenario.as_ref().map(|scenario| scenario.path.plan());
        let runs = Runs::new(settings.runs());
        let anywhere = Anywhere::new(&scenario, &settings, &runs)?;
        let anywhere =
            anywhere.map(|found| found.with_landmarks(&scenario, path, &settings, &runs));
        let anywhere = anywhere.transpose()?;
        runs.end()?;
        let forecast = anywhere.map(|anywhere| Forecast { anywhere, furniture });
        if let (Some(out), Some(forecast)) = (&self.out, &forecast) {
            sonarfix_files::write(out, forecast.drawing(map).svg())?;
            eprintln!("open {}", out.display());
        }
        Ok(forecast)
    }
}

/// The robot on the map: that of `--robot`, of the scenario, or that of the floor plans.
fn scenario(map: &MapFile, robot: Option<&Path>) -> anyhow::Result<Scenario> {
    let mut scenario = match &map.scenario {
        Some(scenario) => (**scenario).clone(),
        None => bare::scenario(map.floor.clone(), map.name().to_owned())?,
    };
    if let Some(robot) = robot {
        bare::fit(&mut scenario, robot_file::read(robot)?);
    }
    Ok(scenario)
}

/// What the starts lead to, and with how much furniture.
pub struct Forecast {
    pub anywhere: Anywhere,
    furniture: f64,
}

impl Forecast {
    /// As text.
    pub fn print(&self, map: &MapFile) {
        let Anywhere { times, confused, landmarks, .. } = &self.anywhere;
        println!("{}", self.table().text());
        for confusion in confused.iter().take(SHOWN) {
            println!("confused: {}", confusion_text(confusion));
        }
        if confused.len() > SHOWN {
            println!("and {} more", confused.len() - SHOWN);
        }
        if let Some(landmarks) = landmarks {
            println!("{}", advice(landmarks, times, map));
        }
    }

    fn table(&self) -> Table {
        let Anywhere { times, landmarks, .. } = &self.anywhere;
        let rows = [
            ("as it is", Some(times)),
            ("with the boards", landmarks.as_ref().map(|it| &it.times)),
        ];
        let rows = rows.into_iter().filter_map(|(name, times)| Some(row(name, times?)));
        Table {
            title: "Starts without a pose, anywhere".to_owned(),
            note: format!(
                "Each for at most {:.0} s, on a drive to random places, with {} pieces of furniture on 10 m² that the map does not \
                 have. Seconds until the pose is unique and right: of half of the starts, and of nine in ten.",
                times.seconds, self.furniture
            ),
            columns: ["map", "starts", "right", "wrong", "no answer", "half (s)", "9 in 10 (s)"]
                .map(str::to_owned)
                .to_vec(),
            rows: rows.collect(),
        }
    }

    fn drawing<'a>(&self, map: &'a MapFile) -> StartsMap<'a> {
        let Anywhere { times, confused, landmarks, places } = &self.anywhere;
        let dot = |start: &Start| Dot {
            at: start.at,
            after: start.after,
            is_wrong: start.outcome == Outcome::Wrong,
        };
        let pairs = confused.iter().flat_map(|confusion| &confusion.pairs);
        let boards = landmarks.as_ref();
        StartsMap {
            title: format!("Starts without a pose: {}", summary(times)),
            floor: &map.floor,
            starts: places.iter().map(dot).collect(),
            seconds: times.seconds,
            confused: pairs.map(|pair| pair.map(|[x, y, _]| [x, y])).collect(),
            boards: boards.map_or_else(Vec::new, |it| it.ends().collect()),
            effect: boards.map_or_else(String::new, |it| {
                format!("proposed boards of 40 cm: {}", summary(&it.times))
            }),
        }
    }
}

fn seconds(time: Option<f64>) -> String {
    time.map_or("-".to_owned(), |time| format!("{time:.1}"))
}

fn percent(share: f64) -> String {
    format!("{:.0} %", 100.0 * share)
}

fn row(name: &str, times: &Times) -> Vec<String> {
    vec![
        name.to_owned(),
        times.starts.to_string(),
        percent(times.right),
        percent(times.wrong),
        percent(times.unanswered()),
        seconds(times.median_seconds),
        seconds(times.most_seconds),
    ]
}

/// The times in a few words.
fn summary(times: &Times) -> String {
    let median = match times.median_seconds {
        Some(median) => format!("half within {median:.0} s"),
        None => format!("fewer than half within {:.0} s", times.seconds),
    };
    format!("{median}, {} without a right answer", percent(1.0 - times.right))
}

fn confusion_text(confusion: &Confusion) -> String {
    let pose =
        |[x, y, heading]: [f64; 3]| format!("({x:.1}, {y:.1}) m at {:.0}°", heading.to_degrees());
    let starts = if confusion.pairs.len() == 1 { "start" } else { "starts" };
    let example = confusion.pairs.first().map_or_else(String::new, |[one, other]| {
        format!(", as {} and {}", pose(*one), pose(*other))
    });
    format!("{}, in {} {starts}{example}", confusion.motion, confusion.pairs.len())
}

/// What the boards are, and what they change.
fn advice(landmarks: &Landmarks, without: &Times, map: &MapFile) -> String {
    let boards = landmarks.boards.iter().zip(landmarks.ends());
    let each = boards.map(|(place, [[x0, y0], [x1, y1]])| {
        let (addition, wall) = (place.addition, map.quoted(place.wall));
        format!("{addition} on {wall}, from ({x0:.2}, {y0:.2}) to ({x1:.2}, {y1:.2}) m")
    });
    let each: Vec<String> = each.collect();
    let (before, after) = (summary(without), summary(&landmarks.times));
    format!(
        "{}, mapped and not hidden by furniture: {after}, instead of {before}",
        each.join(", and ")
    )
}
