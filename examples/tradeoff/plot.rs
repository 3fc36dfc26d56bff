//! Error over time, both on logarithmic axes.

use crate::rows::Row;
use crate::sweep::PRESET;
use crate::tables::front;
use plotters::prelude::*;
use std::path::Path;

const TRACERS: [(&str, RGBColor); 3] = [
    ("image-space", RGBColor(31, 119, 180)),
    ("hybrid", RGBColor(44, 140, 44)),
    ("bvh", RGBColor(214, 39, 40)),
];

/// Draws the points of indirect light.
pub(crate) fn draw(path: &Path, name: &str, rows: &[Row]) -> Result<(), String> {
    let rows: Vec<&Row> = rows.iter().filter(|r| r.component == "indirect").collect();
    if rows.is_empty() {
        return Ok(());
    }
    try_draw(path, name, &rows).map_err(|e| format!("{}: {e}", path.display()))
}

fn try_draw(path: &Path, name: &str, rows: &[&Row]) -> Result<(), Box<dyn std::error::Error>> {
    let at = |row: &Row| (row.ms, row.relmse);
    let range = |of: fn((f64, f64)) -> f64| {
        let values = || rows.iter().map(|row| of(at(row)));
        let (low, high) = (values().fold(f64::MAX, f64::min), values().fold(0.0, f64::max));
        (low / 1.3..high * 2.0).log_scale()
    };
    let area = SVGBackend::new(path, (820, 540)).into_drawing_area();
    area.fill(&WHITE)?;
    let mut chart = ChartBuilder::on(&area)
        .margin(16)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .caption(format!("Indirect light of {name}: error over time"), ("sans-serif", 18))
        .build_cartesian_2d(range(|p| p.0), range(|p| p.1))?;
    chart
        .configure_mesh()
        .x_desc("ms a picture")
        .y_desc("relMSE")
        .x_label_formatter(&|v| format!("{v:.0}"))
        .y_label_formatter(&|v| format!("{v:.1e}"))
        .light_line_style(BLACK.mix(0.06))
        .max_light_lines(8)
        .draw()?;
    for (tracer, color) in TRACERS {
        let own = || rows.iter().filter(|r| r.tracer == tracer);
        if own().next().is_none() {
            continue;
        }
        chart
            .draw_series(own().map(|row| Circle::new(at(row), 3, color.mix(0.6).filled())))?
            .label(tracer)
            .legend(move |(x, y)| Circle::new((x + 10, y), 4, color.filled()));
        let presets = own().filter(|r| r.knob == PRESET);
        chart.draw_series(presets.map(|row| {
            EmptyElement::at(at(row))
                + TriangleMarker::new((0, 0), 7, color.filled())
                + Text::new(
                    row.value.clone(),
                    (8, -14),
                    ("sans-serif", 13).into_font().color(&color),
                )
        }))?;
    }
    chart
        .draw_series(LineSeries::new(front(rows).into_iter().map(at), BLACK.stroke_width(1)))?
        .label("front")
        .legend(|(x, y)| PathElement::new([(x, y), (x + 20, y)], BLACK.stroke_width(1)));
    chart
        .configure_series_labels()
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.8))
        .border_style(BLACK)
        .draw()?;
    area.present()?;
    Ok(())
}
