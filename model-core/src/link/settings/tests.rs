//! Signals of outputs.

use super::*;

#[test]
fn a_command_is_a_part_of_the_output_between_its_low_and_one() {
    let current = CommandOutput { low: 0.2, full_pa: 1e6 };
    let parts =
        [(0.0, 0.2), (250e3, 0.4), (1e6, 1.0), (1.1e6, 1.0), (5e6, 1.0), (-1e5, 0.2), (f32::NAN, 0.2)];
    for (pressure_pa, part) in parts {
        assert!((current.part(pressure_pa) - part).abs() < 1e-6, "{part} at {pressure_pa}");
    }
}
