//! What a correction of the readings changes in an answer that was found in corrected recordings.

use model_core::braid::Braid;

use super::baselines::{self, Baseline, Kind};
use super::criteria::baseline::TABLE_ORDER;
use super::criteria::judgement::CHECK_RESOLUTION;
use super::cross_validation::HeldOutRows;
use super::location::locate;
use super::rows::{self, Rows};
use super::verdict::{Diagnosis, Outcome, Verdict};
use pam_data::error::Result;
use pam_data::recording::Campaign;

/// The rows of recordings at which the muscle is not slack; of corrected ones, with the readings as they were.
///
/// # Errors
/// A recording without force.
pub(crate) fn under_load(
    campaign: &Campaign,
    as_read: Option<&Campaign>,
    braid: &Braid<f64>,
) -> Result<Rows> {
    let (rows, _) = rows::prepare_corrected(campaign, as_read, braid)?;
    let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
    Ok(baselines::without_slack(&rows, &fitted).0)
}

/// The error of the model as it was, rms, N.
pub(crate) fn misfit(rows: &Rows) -> f64 {
    baselines::fit(rows, Kind::Flexible(TABLE_ORDER), &[]).rms(rows)
}

/// Recordings with one bladder for all pressures: as they were read, or corrected.
pub(crate) struct AsRead {
    rows: Rows,
    fitted: Baseline,
}

/// What a correction removes of the error.
pub(crate) struct Removed {
    /// Its share of the squared error above the noise.
    pub share: f64,
    /// Root mean square of the residual, N.
    pub left: f64,
}

impl AsRead {
    /// Of recordings; of corrected ones, with the readings as they were.
    ///
    /// # Errors
    /// A recording without force.
    pub(crate) fn of(campaign: &Campaign, as_read: Option<&Campaign>, braid: &Braid<f64>) -> Result<Self> {
        let rows = under_load(campaign, as_read, braid)?;
        let fitted = baselines::fit(&rows, Kind::Stiff, &[]);
        Ok(Self { rows, fitted })
    }

    /// The rows, linearised about the model.
    pub(crate) fn linearised(&self) -> Rows {
        baselines::linearised(&self.rows, &self.fitted)
    }

    /// Makes an answer that was found in corrected recordings one about these: their error, the error on held-out rows before, and the
    /// shares that effects explain of the whole. `kind` is the baseline of the answer.
    pub(crate) fn enter(&self, diagnosis: &mut Diagnosis, kind: Kind, corrected: &Self) -> Removed {
        let Self { rows, fitted } = self;
        let (was, is) = (fitted.per_row(rows), corrected.fitted.per_row(&corrected.rows));
        let noise = diagnosis.noise_N.powi(2);
        let share =
            ((was - is) / (was - noise).max(CHECK_RESOLUTION * was).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0);
        for m in &mut diagnosis.missing {
            m.share_explained *= 1.0 - share;
        }
        diagnosis.unexplained.share *= 1.0 - share;
        diagnosis.misfit_rms_N = misfit(rows);
        let unseen = HeldOutRows::new(rows, kind, &[]).held_out(&[], diagnosis.noise_N);
        // Selected effects may need another split, whose errors are not comparable with this one's.
        if unseen.split == diagnosis.held_out.split {
            diagnosis.held_out.rms_before_N = unseen.rms_before_N;
            diagnosis.held_out.with_turns_before_N = unseen.with_turns_before_N;
        }
        if diagnosis.verdict() == Verdict::Consistent {
            diagnosis.outcome = Outcome::Judged(Verdict::Explained);
            if rows.len() == corrected.rows.len() {
                let located =
                    locate(rows, &fitted.residual, &corrected.fitted.residual, diagnosis.noise_N, 7);
                (diagnosis.r#where, diagnosis.profiles) = (located.regions, located.profiles);
            }
        }
        Removed { share, left: is.sqrt() }
    }
}
