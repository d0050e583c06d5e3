//! Failures of batches and of fleet summaries.

use pam_data::error_codes;

error_codes! {
    /// Failures of batches and of fleet summaries.
    pub enum FleetCode {
        /// A manifest, or one row of it, is not valid.
        ManifestInvalid = "manifest::invalid", Input,
            "give one row per muscle with the columns muscle, description and files";
        /// A folder holds no results of `host batch`, or damaged ones.
        FleetInvalid = "fleet::invalid", Input,
            "run `host batch MANIFEST -o FOLDER`; delete the folder of a damaged muscle first, and it is computed again";
        /// Some muscles of a batch failed, and the call requires an exit status that says so.
        FleetFailed = "fleet::failed", Input,
            "read the table `failures`, which names cause, place and remedy of each";
        /// The computation of one muscle ended abnormally; the others are not affected.
        FleetAborted = "fleet::aborted", Input,
            "report it with the recordings of this muscle; leave the muscle out of the manifest meanwhile";
    }
}
