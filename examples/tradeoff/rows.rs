//! What was measured, in a file of comma-separated values.

use serde::{Deserialize, Serialize};
use std::fs::OpenOptions;
use std::path::{Path, PathBuf};

/// What tells a point from all others.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub(crate) struct Key {
    pub(crate) adapter: String,
    pub(crate) scene: String,
    pub(crate) size: u32,
    /// Paths of each pixel of the truth; 0: from a file.
    pub(crate) samples: u32,
    pub(crate) component: String,
    pub(crate) base: String,
    pub(crate) tracer: String,
    pub(crate) knob: String,
    pub(crate) value: String,
}

/// A point and its figures.
#[derive(Debug, Clone, Serialize, Deserialize)]
pub(crate) struct Row {
    pub(crate) adapter: String,
    pub(crate) scene: String,
    pub(crate) size: u32,
    pub(crate) samples: u32,
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
    pub(crate) fn key(&self) -> Key {
        let row = self.clone();
        Key {
            adapter: row.adapter,
            scene: row.scene,
            size: row.size,
            samples: row.samples,
            component: row.component,
            base: row.base,
            tracer: row.tracer,
            knob: row.knob,
            value: row.value,
        }
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

    /// The last one.
    pub(crate) fn find(&self, key: &Key) -> Option<&Row> {
        self.rows.iter().rev().find(|row| row.key() == *key)
    }

    /// Appends a row, in the file too.
    pub(crate) fn add(&mut self, row: Row) -> Result<Row, String> {
        let at = |e: String| format!("{}: {e}", self.path.display());
        let file = OpenOptions::new().create(true).append(true).open(&self.path);
        let file = file.map_err(|e| at(e.to_string()))?;
        let mut writer = csv::WriterBuilder::new()
            .has_headers(self.rows.is_empty())
            .from_writer(file);
        writer.serialize(&row).map_err(|e| at(e.to_string()))?;
        writer.flush().map_err(|e| at(e.to_string()))?;
        self.rows.push(row.clone());
        Ok(row)
    }
}
