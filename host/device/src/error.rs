//! Failures of controllers and of the link to them.

use pam_data::error_codes;

error_codes! {
    /// Failures of controllers and of the link to them.
    pub enum DeviceCode {
        /// The port cannot be opened.
        DevicePort = "device::port", Input,
            "`host device list` shows the ports here";
        /// The device does not answer, or stopped answering.
        DeviceSilent = "device::silent", Input,
            "check the cable and the supply, then try again";
        /// Something answers, and it is not a controller of ours.
        DeviceForeign = "device::foreign", Input,
            "is this the controller's port? if it is its board, flash the firmware first";
        /// The device speaks another version.
        DeviceVersion = "device::version", Input,
            "build and flash program and firmware from the same release";
        /// The device refused the setpoint.
        DeviceRefused = "device::refused", Input,
            "`host device info` shows what it is doing, `host device settings` what it allows";
        /// Another program controls the device.
        DeviceInUse = "device::in-use", Input,
            "end the other program; `host vent` ends its run";
        /// What the device keeps is not what it was sent.
        DeviceVerify = "device::verify", Input,
            "send it again; if the error returns, the memory of the device is failing";
        /// The device stopped because of a fault.
        DeviceFault = "device::fault", Input,
            "`host device faults` shows the fault and its remedy";
    }
}
