//! Why an effect is not named, as values.

/// Why an effect that was considered is not named.
#[derive(Clone, Debug, PartialEq)]
pub enum WhyNot {
    /// Nothing was fitted.
    NotJudged,
    /// These recordings cannot distinguish it from an effect that is named.
    Confusable,
    /// These recordings do not excite it.
    NotExcited,
    /// It could be there, below what these recordings show.
    Hidden,
    /// It explains no more than chance does over all effects tried; the family-wise p.
    Chance(f64),
    /// It was selected and not kept: a remark gives the reason.
    Refused,
    /// It would explain much of a misfit that is within the model's own inexactness.
    WithinInexactness,
    /// It explains too little of the misfit.
    TooLittle,
    /// It explains less than what is named, and little beside it.
    LessThanNamed,
    /// A slack muscle shows less of it.
    SlackReading,
    /// A check of the bench measured it.
    Measured {
        /// Which check.
        check: String,
        /// The value with its interval.
        value: String,
    },
}
