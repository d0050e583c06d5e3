//! A table's muscle, run through recordings row by row.

use model_core::effects::{Chain, Context, Info, Memory};
use model_core::motion::Motion as MotionSample;
use model_core::muscle::Muscle;
use model_core::units::{Length, Pressure};

use crate::beginning::{Beginning, is_stroke};
use crate::bench::Candidate;
use crate::table_file::{Correction, TableFile};
use pam_data::error::{DataCode, Error, Result};
use pam_data::recording::Recording;
use pam_data::recording::motion::Motion;

/// A correction of the bench with its parameters and its memory.
type StoredCorrection<'a> = (Candidate, &'a [f64], Memory<f64>);

/// # Errors
/// A correction that this program does not know.
fn corrections(file: &TableFile) -> Result<Vec<StoredCorrection<'_>>> {
    let known = |c: &Correction| {
        Candidate::from_name(&c.effect).filter(|k| k.info().parameters.len() == c.parameters.len())
    };
    file.about
        .corrections
        .iter()
        .map(|c| {
            let candidate = known(c).ok_or_else(|| {
                Error::new(DataCode::TableInvalid, format!("unknown correction `{}`", c.effect))
                    .help("a newer version of this program wrote the table: update this program")
            })?;
            Ok((candidate, c.parameters.as_slice(), Memory::<f64>::default()))
        })
        .collect()
}

/// A table's muscle with the memory of its effects and corrections.
pub(super) struct Model<'a> {
    pub(super) muscle: Muscle<f64>,
    pub(super) chain: Chain<f64>,
    corrections: Vec<StoredCorrection<'a>>,
}

impl<'a> Model<'a> {
    /// # Errors
    /// A table that cannot be evaluated, or a correction that this program does not know.
    pub(super) fn of(file: &'a TableFile) -> Result<Self> {
        let muscle =
            Muscle::build(&file.table).map_err(|e| Error::new(DataCode::TableInvalid, e.to_string()))?;
        Ok(Self { muscle, chain: Chain::new(&file.table.effects), corrections: corrections(file)? })
    }

    /// Whether the force depends on the present only.
    pub(super) fn is_plain(&self) -> bool {
        self.chain.is_empty() && self.corrections.is_empty()
    }

    /// The force of the base model in every row, N.
    pub(super) fn plain(&self, recording: &Recording, motion: &Motion) -> Vec<f64> {
        let force = |i: usize| {
            let p = Pressure::from_pascals(recording.pressure[i]);
            let x = Length::from_metres(recording.stroke[i]);
            self.muscle.force(p, x, f64::from(motion.direction[i])).newtons()
        };
        (0..recording.len()).map(force).collect()
    }

    /// Puts every memory into the state from which it begins, and lets the first row of a recording pass.
    fn begin(&mut self, first: &Context<f64>, stroke: &Context<f64>, beginning: Beginning) {
        let before = |law: &Info| beginning.concerns(law).then(|| Beginning::before(first, stroke, law));
        let seen = |law: &Info| if beginning.concerns(law) { Beginning::first(first) } else { *first };
        self.chain.step_each(|effect| before(effect.info()));
        self.chain.step_each(|effect| Some(seen(effect.info())));
        for (candidate, parameters, memory) in &mut self.corrections {
            if let Some(context) = before(candidate.info()) {
                candidate.step(parameters, &context, memory);
            }
            candidate.step(parameters, &seen(candidate.info()), memory);
        }
    }

    /// Lets the time of a row pass in every memory.
    fn step(&mut self, row: &Context<f64>) {
        self.chain.step(row);
        for (candidate, parameters, memory) in &mut self.corrections {
            candidate.step(parameters, row, memory);
        }
    }

    /// The force with effects and corrections in every row, N.
    pub(super) fn with_effects(
        &mut self,
        recording: &Recording,
        motions: &[MotionSample<f64>],
        beginning: Beginning,
    ) -> Vec<f64> {
        let row = |muscle: &Muscle<f64>, i: usize| {
            muscle.context(&motions[i], Pressure::from_pascals(recording.pressure[i]))
        };
        let mut forces = Vec::with_capacity(recording.len());
        for i in 0..motions.len() {
            let context = row(&self.muscle, i);
            if i == 0 && beginning != Beginning::default() {
                let stroke = (0..motions.len()).map(|i| row(&self.muscle, i)).find(is_stroke);
                self.begin(&context, &stroke.unwrap_or(context), beginning);
            } else {
                self.step(&context);
            }
            // A slack muscle transmits no force; what the bench adds to the reading acts all the same.
            let (mut pull, mut read) = (context.force() + self.chain.force(&context), 0.0);
            for (candidate, parameters, memory) in &self.corrections {
                let part = candidate.force(parameters, &context, memory);
                *if candidate.acts_on_a_slack_muscle(0) { &mut read } else { &mut pull } += part;
            }
            forces.push(self.muscle.pull(pull).newtons() + read);
        }
        forces
    }
}
