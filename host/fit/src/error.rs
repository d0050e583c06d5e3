//! Failures of fits.

use pam_data::error_codes;

error_codes! {
    /// Failures of fits.
    pub enum FitCode {
        /// The data do not allow the fit that was requested.
        FitUnderdetermined = "fit::underdetermined", Input,
            "record more pressures, and more lengths or longer strokes";
        /// The fitted table has values that no muscle has, or contradicts its recordings.
        FitImplausible = "fit::implausible", Input,
            "correct the cause, or write the table nevertheless with --force";
    }
}
