//! The force of one effect per unit of each amplitude, row by row through a campaign beside a table: what a fit of its amplitudes needs.

use model_core::effects::{EffectName, MEMORY};
use model_core::muscle::Muscle;
use model_core::units::Pressure;

use crate::predict::with_true_length;
use crate::table_file::TableFile;
use crate::vented_rest;
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::motion::Motion;
use pam_data::recording::{Campaign, Follower};

/// By amplitude, the force in every row of all recordings, N. `shapes` are the effect's other parameters. Lengths are corrected as
/// the table's mountings give, and rests between recordings count as in a prediction.
///
/// # Errors
/// [`DataCode::TableInvalid`] where the table cannot be evaluated.
pub fn effect_columns(
    file: &TableFile,
    campaign: &Campaign,
    effect: EffectName,
    shapes: &[f64],
) -> Result<Vec<Vec<f64>>> {
    let muscle =
        Muscle::<f64>::build(&file.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
    let amplitudes = effect.info().amplitudes();
    let mut parameters = vec![0.0; amplitudes];
    parameters.extend_from_slice(shapes);
    parameters.resize(effect.info().parameters.len(), 0.0);
    let mut columns = vec![Vec::with_capacity(campaign.samples()); amplitudes];
    let mut memory = [0.0; MEMORY];
    let rests = campaign.rests();
    let mut follower = Follower::of(campaign);
    for (index, (recording, motion)) in
        campaign.recordings.iter().zip(Motion::of_campaign(campaign)).enumerate()
    {
        let recording = with_true_length(file, recording);
        let mut motions = follower.follow(&recording, &motion, campaign.pause_before(index));
        if let Some(rest) = rests.as_ref().and_then(|rests| rests.get(index)) {
            for context in
                vented_rest::contexts(&muscle, &mut motions, rest, file.about.earlier_load.as_ref())
            {
                effect.step(&parameters, &context, &mut memory);
            }
        }
        for (motion, pressure) in motions.iter().zip(&recording.pressure) {
            let context = muscle.context(motion, Pressure::from_pascals(*pressure));
            effect.step(&parameters, &context, &mut memory);
            for (i, column) in columns.iter_mut().enumerate() {
                parameters[i] = 1.0;
                column.push(effect.force(&parameters, &context, &memory));
                parameters[i] = 0.0;
            }
        }
    }
    Ok(columns)
}
