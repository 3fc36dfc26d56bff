//! What was measured, in a file of comma-separated values.

use serde::{Deserialize, Serialize};
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

/// A point and its figures.
#[derive(Debug, Clone, Default, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) adapter: String,
    pub(crate) scene: String,
    pub(crate) size: u32,
    pub(crate) truth: String,
    pub(crate) component: String,
    pub(crate) base: String,
    pub(crate) tracer: String,
    pub(crate) knob: String,
    pub(crate) value: String,
    /// Of all frames of the picture, milliseconds.
    pub(crate) ms: f64,
    pub(crate) relmse: f64,
    /// Energy bias.
    pub(crate) bias: f64,
    /// Estimated without the truth, relMSE; none where pictures are sums of frames, or no kernels are.
    pub(crate) noise: Option<f64>,
    pub(crate) blur: Option<f64>,
    /// Share of the flux sent from surfaces that was lost, or arrived where the tracer is not sure.
    pub(crate) unconfirmed: Option<f64>,
}

impl Row {
    /// Whether both are of the same scene, as large and compared with the same truth.
    fn is_of_scene(&self, other: &Self) -> bool {
        let of = |row: &Self| [&row.adapter, &row.scene, &row.truth].map(String::clone);
        self.size == other.size && of(self) == of(other)
    }

    /// Whether both are of the same point, whatever its figures.
    fn is_of_point(&self, other: &Self) -> bool {
        let of = |row: &Self| [&row.component, &row.base, &row.tracer, &row.knob, &row.value].map(String::clone);
        self.is_of_scene(other) && of(self) == of(other)
    }
}

/// All rows of a file.
pub(crate) struct Rows {
    path: PathBuf,
    rows: Vec<Row>,
}

impl Rows {
    /// Those that are there.
    pub(crate) fn open(path: &Path) -> Result<Self, String> {
        let at = |e: csv::Error| format!("{}: {e}", path.display());
        let mut rows = Vec::new();
        if path.exists() {
            for row in csv::Reader::from_path(path).map_err(at)?.deserialize() {
                rows.push(row.map_err(at)?);
            }
        }
        Ok(Self {
            path: path.into(),
            rows,
        })
    }

    pub(crate) fn has(&self, point: &Row) -> bool {
        self.rows.iter().any(|row| row.is_of_point(point))
    }

    /// All of the scene that a row is of; of rows of the same point the last one.
    pub(crate) fn of_scene(&self, scene: &Row) -> Vec<Row> {
        let indexed = self.rows.iter().enumerate().filter(|(_, row)| row.is_of_scene(scene));
        let last = indexed.filter(|(index, row)| !self.rows[index + 1..].iter().any(|later| later.is_of_point(row)));
        last.map(|(_, row)| row.clone()).collect()
    }

    /// Appends a row, in the file too.
    pub(crate) fn add(&mut self, row: Row) -> Result<(), String> {
        let at = |e: String| format!("{}: {e}", self.path.display());
        let file = OpenOptions::new().create(true).append(true).open(&self.path);
        let file = file.map_err(|e| at(e.to_string()))?;
        let mut writer = csv::WriterBuilder::new()
            .has_headers(self.rows.is_empty())
            .from_writer(file);
        writer.serialize(&row).map_err(|e| at(e.to_string()))?;
        writer.flush().map_err(|e| at(e.to_string()))?;
        self.rows.push(row);
        Ok(())
    }
}
