//! What rows say, in words and figures.

use crate::rows::Row;
use crate::sweep::PRESET;
use std::fmt::Write;

/// Factor that an estimate may be off by, to count as near.
const NEAR: f64 = 2.0;

/// Points than which none is both faster and nearer to the truth, from the fastest on.
pub(crate) fn front<'a>(rows: &[&'a Row]) -> Vec<&'a Row> {
    let mut sorted = rows.to_vec();
    sorted.sort_by(|a, b| a.ms.total_cmp(&b.ms));
    let mut best = f64::INFINITY;
    sorted.retain(|row| {
        let is_better = row.relmse < best;
        best = best.min(row.relmse);
        is_better
    });
    sorted
}

/// All tables of a scene.
pub(crate) fn of_scene(name: &str, rows: &[Row]) -> String {
    let mut text = format!("\n## {name}\n");
    let indirect: Vec<&Row> = rows.iter().filter(|r| r.component == "indirect").collect();
    presets(&mut text, &indirect);
    front_table(&mut text, &indirect);
    steps(&mut text, rows);
    estimates(&mut text, &indirect);
    text
}

/// Writing to a string does not fail.
macro_rules! line {
    ($text:expr, $($rest:tt)*) => { let _ = writeln!($text, $($rest)*); };
}

fn presets(text: &mut String, rows: &[&Row]) {
    let front = front(rows);
    // How much more error than the best that takes no more time.
    let behind = |row: &Row| {
        let best = front.iter().rev().find(|f| f.ms <= row.ms);
        best.map_or(1.0, |best| row.relmse / best.relmse)
    };
    line!(
        text,
        "\n| preset | ms | relMSE | energy bias | error over the front's at its time |\n|---|---|---|---|---|"
    );
    for row in rows.iter().filter(|r| r.knob == PRESET) {
        line!(
            text,
            "| {}, {} | {:.0} | {:.4} | {:+.2} % | {:.2} |",
            row.value,
            row.tracer,
            row.ms,
            row.relmse,
            100.0 * row.bias,
            behind(row)
        );
    }
}

fn front_table(text: &mut String, rows: &[&Row]) {
    line!(
        text,
        "\n| on the front | ms | relMSE | energy bias |\n|---|---|---|---|"
    );
    for row in front(rows) {
        let what = match row.knob.as_str() {
            PRESET => format!("{}, {}", row.value, row.tracer),
            knob => format!("{}, {}, {knob}={}", row.base, row.tracer, row.value),
        };
        line!(
            text,
            "| {what} | {:.0} | {:.4} | {:+.2} % |",
            row.ms,
            row.relmse,
            100.0 * row.bias
        );
    }
}

/// What each value of each knob costs and gains over the one before.
fn steps(text: &mut String, rows: &[Row]) {
    line!(
        text,
        "\n| knob | base | step | time | error | energy bias |\n|---|---|---|---|---|---|"
    );
    let of = |row: &Row| [&row.base, &row.tracer, &row.component, &row.knob].map(String::clone);
    for pair in rows.windows(2) {
        let [a, b] = pair else { continue };
        if b.knob == PRESET || of(a) != of(b) {
            continue;
        }
        line!(
            text,
            "| `{}` | {} | {} → {} | × {:.2} | × {:.2} | {:+.2} → {:+.2} % |",
            b.knob,
            match b.component.as_str() {
                "direct" => b.base.clone(),
                _ => format!("{}, {}", b.base, b.tracer),
            },
            a.value,
            b.value,
            b.ms / a.ms,
            b.relmse / a.relmse,
            100.0 * a.bias,
            100.0 * b.bias
        );
    }
}

/// How near estimates without a truth come.
fn estimates(text: &mut String, rows: &[&Row]) {
    line!(
        text,
        "\n| tracer | estimates | within a factor of {NEAR} | median of estimate over truth | flux unconfirmed |\n\
        |---|---|---|---|---|"
    );
    for tracer in ["image-space", "hybrid", "bvh"] {
        let own: Vec<&&Row> = rows.iter().filter(|r| r.tracer == tracer).collect();
        let mut ratios: Vec<f64> = own
            .iter()
            .filter_map(|r| Some((r.noise? + r.blur?) / r.relmse))
            .collect();
        if ratios.is_empty() {
            continue;
        }
        ratios.sort_by(f64::total_cmp);
        let near = ratios.iter().filter(|&&r| (1.0 / NEAR..=NEAR).contains(&r)).count();
        let unconfirmed = own.iter().filter_map(|r| r.unconfirmed).fold(0.0, f64::max);
        line!(
            text,
            "| {tracer} | {} | {:.0} % | {:.2} | up to {:.1} % |",
            ratios.len(),
            100.0 * near as f64 / ratios.len() as f64,
            ratios[ratios.len() / 2],
            100.0 * unconfirmed
        );
    }
}
