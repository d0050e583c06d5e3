//! `host studio`: the live view in the browser.

use std::path::PathBuf;
use std::sync::{Arc, Mutex};

use clap::Args;

use crate::console::Console;
use crate::documents::{bench, line};
use crate::studio::server::{First, serve};
use pam_data::error::{DataCode, Error, Result};

/// Arguments of `host studio`.
#[derive(Debug, Args)]
#[command(
    after_help = "Examples:\n  host studio\n  host studio --port /dev/ttyACM0\n  host studio --emulate\n\n\
    The page is for this machine only. Escape vents. When the last page closes, the controller is vented and disarmed, \
    unless another program has started its run."
)]
pub struct Arguments {
    /// Connect to this device immediately, unless an emulated one is requested.
    #[arg(short, long, value_name = "PORT", env = "PAM_PORT")]
    port: Option<String>,
    /// Start an emulated controller with this muscle of the virtual bench: mini (where none is named), contractile, push or
    /// random:SEED.
    #[arg(long, value_name = "MUSCLE", num_args = 0..=1, default_missing_value = "mini")]
    emulate: Option<String>,
    /// The page's own port; 0: any that is free.
    #[arg(long, value_name = "N", default_value_t = 0)]
    web_port: u16,
    /// The folder for recordings and tables.
    #[arg(short, long, value_name = "FOLDER", default_value = "pam-studio")]
    output: PathBuf,
    /// Print the address as JSON.
    #[arg(long)]
    json: bool,
}

impl Arguments {
    /// Serves the page until Ctrl-C.
    ///
    /// # Errors
    /// A port that cannot be used, a device that cannot be reached.
    pub fn run(self, console: &Console) -> Result<()> {
        let first = self.emulate.map(First::Emulate).or(self.port.map(First::Connect));
        let (send, stop) = tokio::sync::oneshot::channel::<()>();
        let send = Arc::new(Mutex::new(Some(send)));
        ctrlc::set_handler(move || {
            if let Ok(mut send) = send.lock()
                && let Some(send) = send.take()
            {
                let _ = send.send(());
            }
        })
        .map_err(|e| Error::new(DataCode::CallInvalid, format!("Ctrl-C cannot be handled: {e}")))?;
        let ready = |address: &str| {
            if self.json {
                // A document of two strings can always be written.
                console.result(line(&bench::Studio { schema: "pam-studio/1", address }).unwrap_or_default());
            } else {
                console.result(format!("open {address}"));
            }
            console.note("Ctrl-C here, or closing the last page, vents what this page has started");
        };
        serve(self.web_port, self.output, first, ready, async {
            let _ = stop.await;
        })?;
        console.note("ended; what this page had started is vented");
        Ok(())
    }
}
