//! What is right: the hits of environment maps against those of triangles.

use lightfall::glam::Vec3;
use lightfall::resource::{Photon, SurfaceHit, SurfaceHitKind};

/// What a ray truly meets.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Truth {
    pub(crate) distance: f32,
    /// Geometric, on the side hit.
    pub(crate) normal: Vec3,
}

/// A position counts as right within this share of the scene's diagonal.
const NEAR: f32 = 0.01;
/// A normal within this angle.
const ALIKE: f32 = 10.0;

/// What became of a list of rays, as shares: of the rays that meet something, unless said otherwise.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Verdict {
    pub(crate) correct: f64,
    /// Hits elsewhere, or of another surface.
    pub(crate) wrong: f64,
    pub(crate) lost: f64,
    /// Of the wrong: where the position is right.
    pub(crate) wrong_normal: f64,
    /// Of the rays that meet nothing: those that hit something.
    pub(crate) ghost: f64,
    /// Of all rays: those that a hybrid traces again.
    pub(crate) again: f64,
    /// Of all rays: those that are right once these are.
    pub(crate) hybrid: f64,
    /// Share of the diagonal that hits of the right surface are off, 50th and 95th percentile.
    pub(crate) error: [f64; 2],
}

/// Whether a hit is that of the truth: position and normal.
pub(crate) fn agrees(truth: &Truth, distance: f32, normal: Vec3, diagonal: f32) -> [bool; 2] {
    let near = (distance - truth.distance).abs() < NEAR * diagonal;
    [near, near && normal.dot(truth.normal) > ALIKE.to_radians().cos()]
}

/// Judges the hits of a list of rays, in a scene of this diagonal (unit frame).
pub(crate) fn judge(truths: &[Option<Truth>], hits: &[SurfaceHit], diagonal: f32) -> Verdict {
    let mut verdict = Verdict::default();
    let (mut meeting, mut leaving) = (0.0f64, 0.0f64);
    let mut errors = Vec::new();
    for (truth, hit) in truths.iter().zip(hits) {
        let kind = hit.kind();
        let is_hit = matches!(kind, SurfaceHitKind::Surface | SurfaceHitKind::Tentative);
        let is_again = matches!(kind, SurfaceHitKind::Lost | SurfaceHitKind::Tentative);
        let is_right = match truth {
            Some(truth) => {
                meeting += 1.0;
                let [near, same] = agrees(truth, hit.distance, Photon::unpack_unit_vector(hit.normal), diagonal);
                let (near, same) = (is_hit && near, is_hit && same);
                verdict.correct += f64::from(same);
                verdict.wrong += f64::from(is_hit && !same);
                verdict.wrong_normal += f64::from(near && !same);
                verdict.lost += f64::from(!is_hit);
                if same {
                    errors.push(f64::from((hit.distance - truth.distance).abs() / diagonal));
                }
                same
            }
            None => {
                leaving += 1.0;
                verdict.ghost += f64::from(is_hit);
                !is_hit
            }
        };
        verdict.again += f64::from(is_again);
        verdict.hybrid += f64::from(is_right || is_again);
    }
    let all = meeting + leaving;
    for share in [
        &mut verdict.correct,
        &mut verdict.wrong,
        &mut verdict.lost,
        &mut verdict.wrong_normal,
    ] {
        *share /= meeting.max(1.0);
    }
    verdict.ghost /= leaving.max(1.0);
    verdict.again /= all;
    verdict.hybrid /= all;
    verdict.error = [0.5, 0.95].map(|part| percentile(&mut errors, part));
    verdict
}

/// Percentile of values, 0 for none.
pub(crate) fn percentile(values: &mut [f64], part: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    let index = part * values.len().saturating_sub(1) as f64;
    values.get(index as usize).copied().unwrap_or(0.0)
}
