//! Failures of fits.

use pam_data::error_codes;

error_codes! {
    /// Failures of fits.
    pub enum FitCode {
        /// The data do not allow the fit that was requested.
        FitUnderdetermined = "fit::underdetermined", Input,
            "record more pressures, or longer strokes";
    }
}
