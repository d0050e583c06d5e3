//! Failures of the program itself.

use pam_data::error::{Code, DataCode};
use pam_data::error_codes;
use pam_device::error::DeviceCode;
use pam_fit::error::FitCode;
use pam_fleet::error::FleetCode;

error_codes! {
    /// Failures of the program itself.
    pub enum HostCode {
        /// A settings file is not valid.
        SettingsInvalid = "settings::invalid", Input,
            "`host settings --example` prints a file to begin with";
    }
}

/// The codes of every crate, in the order of the manual.
#[must_use]
pub fn all_codes() -> Vec<Code> {
    fn of<T: Copy + Into<Code>>(codes: &[T]) -> impl Iterator<Item = Code> + '_ {
        codes.iter().map(|code| (*code).into())
    }
    let (calls, files): (Vec<Code>, Vec<Code>) =
        of(DataCode::ALL).partition(|code| *code == DataCode::CallInvalid);
    let ours = of(FitCode::ALL).chain(of(FleetCode::ALL)).chain(of(HostCode::ALL)).chain(of(DeviceCode::ALL));
    files.into_iter().chain(ours).chain(calls).collect()
}
