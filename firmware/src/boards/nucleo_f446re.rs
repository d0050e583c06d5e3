//! ST Nucleo-F446RE.
