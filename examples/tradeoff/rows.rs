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
    /// A file, or paths of each pixel.
    pub(crate) truth: String,
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
    pub(crate) fn key(&self) -> Key {
        let row = self.clone();
        Key {
            adapter: row.adapter,
            scene: row.scene,
            size: row.size,
            truth: row.truth,
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

    pub(crate) fn has(&self, key: &Key) -> bool {
        self.rows.iter().any(|row| row.key() == *key)
    }

    /// All of the scene that a key is of, as large and compared with the same truth; of rows of the same point the last one.
    pub(crate) fn of_scene(&self, key: &Key) -> Vec<Row> {
        let is_of = |own: &Key| {
            (&own.adapter, &own.scene, own.size, &own.truth) == (&key.adapter, &key.scene, key.size, &key.truth)
        };
        let keys: Vec<Key> = self.rows.iter().map(Row::key).collect();
        let is_last = |index: usize| !keys[index + 1..].contains(&keys[index]);
        let indexed = self.rows.iter().enumerate();
        let kept = indexed.filter(|(index, _)| is_of(&keys[*index]) && is_last(*index));
        kept.map(|(_, row)| row.clone()).collect()
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
