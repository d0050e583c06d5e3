//! One file per board. Nothing outside this folder queries which board it is.

#[cfg(feature = "mps2-an386")]
mod mps2_an386;
#[cfg(feature = "nucleo-f446re")]
mod nucleo_f446re;

mod division;
mod memory;
#[allow(dead_code, reason = "without a board there are no registers")]
mod register;

/// A line of the log, where logs are built in.
#[allow(unused_macros, reason = "not every board logs")]
macro_rules! log {
    ($($arguments:tt)*) => {{
        #[cfg(feature = "log")]
        defmt::info!($($arguments)*);
    }};
}
#[allow(unused_imports, reason = "not every board logs")]
use log;
