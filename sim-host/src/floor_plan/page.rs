//! What came out of the comparison, for the documentation.

use std::fmt::Write;

use sonarfix::aim::Policy;

use super::Kind;
use super::compare::{
    CompareError, Interval, Pair, PlanResult, Score, informative, median_ratio, nearest, quantile,
};
use super::picture::Runs;
use crate::report::heat_map::HeatMap;

/// How many of the worst plans are told one by one.
const TOLD: usize = 10;
/// What is called worse.
const WORSE: f64 = 1.1;

/// The names of the pictures of the worst plan.
pub const PICTURES: [&str; 2] = ["floor-plan-nearest.svg", "floor-plan-informative.svg"];

const HEAD: &str = "\
# The nearest wall or the most informative: floor plans that nobody drew
Written by `sonarfix floor-plans`; change the code, not this page.

";

const ABOUT: &str = "\
Each plan comes from a seed: a *home* (rooms that open into each other), an *office* (rooms on both sides of a corridor)
or a *lab* (few large rooms), 4 m to 20 m long, with doors of 0.8 m to 1.1 m, walls as single lines or 8 cm to 24 cm
thick, and furniture: of the large pieces the map knows half, of the small ones none. The way leads through the rooms and
their doors for 25 m to 50 m and more, and keeps 20 cm from every wall. `sonarfix floor-plans --draw SEED --out plan.svg
--toml plan.toml` shows a plan and writes its scenario.

The robot is one that fits through doors (track width 230 mm known to 4 mm, wheels to 0.5 %), with an HC-SR04 on an SG90
that turns ±100°, simulated down to its pins: misses, outliers, corners, edges and furniture that answer in a wall's place.
It follows the way exactly, so that both policies see the same from the same places; a seed gives both the same wheels
and the same start. *Ratio* is position RMS over all runs and the whole way, informative over nearest. *Lost*: see
`statistics.rs`: at the end more than 0.5 m or 15° off, or given up by the health verdict. Intervals are 95 % bootstrap
intervals, over the runs for a plan and over the plans for the median.

";

/// The page; the worst plan is run once more for its pictures.
///
/// # Errors
/// [`CompareError`], of a run of the worst plan.
pub fn markdown(results: &[PlanResult]) -> Result<(String, Vec<HeatMap>), CompareError> {
    let mut page = format!("{HEAD}{ABOUT}");
    // Writing to a String cannot fail.
    let _ = write_summary(&mut page, results);
    let _ = write_kinds(&mut page, results);
    let mut by_ratio: Vec<(Interval, &PlanResult)> =
        results.iter().map(|result| (result.ratio(), result)).collect();
    by_ratio.sort_by(|a, b| b.0.value.total_cmp(&a.0.value));
    let _ = write_worst(&mut page, &by_ratio);
    let Some((ratio, worst)) = by_ratio.first() else {
        return Ok((page, Vec::new()));
    };
    let runs = u32::try_from(worst.pairs.len()).unwrap_or(u32::MAX);
    let both = [
        Runs::new(&worst.plan, Policy::Nearest, runs)?,
        Runs::new(&worst.plan, Policy::Informative, runs)?,
    ];
    let _ = write_worst_plan(&mut page, *ratio, worst, &both);
    Ok((page, pictures(&both)))
}

fn total(results: &[PlanResult], count: impl Fn(&PlanResult) -> usize) -> usize {
    results.iter().map(count).sum()
}

fn write_summary(page: &mut String, results: &[PlanResult]) -> std::fmt::Result {
    let (plans, runs) = (results.len(), results.first().map_or(0, |result| result.pairs.len()));
    let ratios: Vec<Interval> = results.iter().map(PlanResult::ratio).collect();
    let values: Vec<f64> = ratios.iter().map(|ratio| ratio.value).collect();
    let count = |is: &dyn Fn(&Interval) -> bool| ratios.iter().filter(|ratio| is(ratio)).count();
    let median = median_ratio(results);
    let first = results.first().map_or(0, |result| result.plan.seed);
    writeln!(
        page,
        "## {plans} plans, each {runs} times under either policy\n\
         Plans from seed {first} on, runs with the seeds 0 to {}.\n\n| | |\n|---|---|",
        runs.saturating_sub(1),
    )?;
    writeln!(page, "| median ratio | {} |", interval(median))?;
    for (name, share) in [("best", 0.0), ("a tenth below", 0.1), ("a tenth above", 0.9)] {
        writeln!(page, "| {name} | {:.3} |", quantile(values.clone(), share))?;
    }
    writeln!(page, "| worst | {:.3} |", quantile(values, 1.0))?;
    let below = count(&|ratio| ratio.value < 1.0);
    writeln!(page, "| plans in which informative is the better | {below} |")?;
    writeln!(page, "| more than 10 % worse | {} |", count(&|ratio| ratio.value > WORSE))?;
    let surely = count(&|ratio| ratio.from > WORSE);
    writeln!(page, "| and so with the whole interval | {surely} |")?;
    let lost = |of: fn(&Pair) -> Score| total(results, |result| result.lost(of));
    let all = plans * runs;
    writeln!(page, "| runs lost, nearest | {} of {all} |", lost(nearest))?;
    writeln!(page, "| runs lost, informative | {} of {all} |", lost(informative))?;
    let more = results.iter().filter(|r| r.lost(informative) > r.lost(nearest)).count();
    let fewer = results.iter().filter(|r| r.lost(informative) < r.lost(nearest)).count();
    writeln!(page, "| plans in which informative loses more runs / fewer | {more} / {fewer} |\n")
}

fn write_kinds(page: &mut String, results: &[PlanResult]) -> std::fmt::Result {
    writeln!(
        page,
        "| | plans | walls, median | way, median | RMS nearest, median | informative, median | \
         median ratio |\n|---|---|---|---|---|---|---|"
    )?;
    for kind in Kind::ALL {
        let of_kind = results.iter().filter(|result| result.plan.kind == kind).cloned();
        let of_kind: Vec<PlanResult> = of_kind.collect();
        if of_kind.is_empty() {
            continue;
        }
        let median =
            |value: &dyn Fn(&PlanResult) -> f64| quantile(of_kind.iter().map(value).collect(), 0.5);
        #[expect(clippy::cast_precision_loss, reason = "some hundred walls")]
        let walls = median(&|result| result.walls as f64);
        writeln!(
            page,
            "| {} | {} | {walls:.0} | {:.0} m | {:.1} mm | {:.1} mm | {} |",
            kind.name(),
            of_kind.len(),
            median(&|result| result.length),
            1e3 * median(&|result| result.rms(nearest)),
            1e3 * median(&|result| result.rms(informative)),
            interval(median_ratio(&of_kind)),
        )?;
    }
    page.push('\n');
    Ok(())
}

fn write_worst(page: &mut String, by_ratio: &[(Interval, &PlanResult)]) -> std::fmt::Result {
    writeln!(
        page,
        "## The worst plans\n| seed | plan | rooms | walls | way | RMS nearest | informative | \
         ratio | lost nearest | informative |\n|---|---|---|---|---|---|---|---|---|---|"
    )?;
    for (ratio, result) in by_ratio.iter().take(TOLD) {
        writeln!(
            page,
            "| {} | {} | {} | {} | {:.0} m | {:.1} mm | {:.1} mm | {} | {} | {} |",
            result.plan.seed,
            result.plan.kind.name(),
            result.plan.rooms,
            result.walls,
            result.length,
            1e3 * result.rms(nearest),
            1e3 * result.rms(informative),
            interval(*ratio),
            result.lost(nearest),
            result.lost(informative),
        )?;
    }
    page.push('\n');
    Ok(())
}

fn write_worst_plan(
    page: &mut String,
    ratio: Interval,
    worst: &PlanResult,
    both: &[Runs; 2],
) -> std::fmt::Result {
    let (seed, kind) = (worst.plan.seed, worst.plan.kind.name());
    let runs = worst.pairs.len();
    writeln!(
        page,
        "## The worst plan\nThe {kind} of seed {seed}, ratio {}. The pictures show where the position \
         was how far off, RMS over {runs} runs. *Misled*: ranges that were accepted though they came \
         from something else than the wall that was looked at.\n",
        interval(ratio),
    )?;
    writeln!(
        page,
        "| | accepted | misled | gated | refused | the most misleading range |\n|---|---|---|---|---|---|"
    )?;
    for (name, runs) in ["nearest", "informative"].into_iter().zip(both) {
        let looks = runs.looks();
        writeln!(
            page,
            "| {name} | {} | {} | {} | {} | {} |",
            looks.accepted,
            looks.misled,
            looks.gated,
            looks.refused,
            runs.most_misleading(),
        )?;
    }
    page.push('\n');
    for (name, file) in ["nearest", "informative"].into_iter().zip(PICTURES) {
        writeln!(
            page,
            "![Floor plan {seed}, {name}: position error along the way](images/{file})\n"
        )?;
    }
    Ok(())
}

/// Both policies' errors on one scale of colours.
fn pictures(both: &[Runs; 2]) -> Vec<HeatMap> {
    let map = |(runs, name): (&Runs, &str)| {
        let place = runs.place();
        HeatMap {
            title: format!("{}: {name}", place.title),
            label: "position error, RMS (mm)".to_owned(),
            path: runs.errors(),
            ..place
        }
    };
    let mut maps: Vec<HeatMap> = both.iter().zip(["nearest", "informative"]).map(map).collect();
    let values = maps.iter().filter_map(HeatMap::values);
    let range = values.reduce(|a, b| a.start.min(b.start)..a.end.max(b.end));
    for map in &mut maps {
        map.range.clone_from(&range);
    }
    maps
}

fn interval(Interval { value, from, to }: Interval) -> String {
    format!("{value:.3} ({from:.3} to {to:.3})")
}
