//! Instructions per call and memory of the images, with bounds on both sides: an improvement is committed on purpose.

use emulator_tests::figures::{self, memory};
use emulator_tests::machine;
use object::{Object, ObjectSection, ObjectSymbol, SectionKind};

#[test]
fn instruction_counts_stay_where_they_are() {
    let Ok(counted) = figures::count() else { return };
    eprintln!("{}", figures::markdown(&counted));
    let of = |name: &str| counted.iter().find(|figure| figure.name == name).expect("counted");
    let (force, inverse, direct, step) = (of("force"), of("inverse"), of("direct-port"), of("step"));
    assert!(force.mean > 100.0 && force.worst <= 132.0, "force: {force:?}");
    assert!(inverse.mean > 200.0 && inverse.worst <= 300.0, "inverse: {inverse:?}");
    assert!(
        direct.mean > 5.0 * force.mean,
        "the direct port is {:.1} times the force",
        direct.mean / force.mean
    );
    assert!(step.mean > 1000.0 && step.mean <= 2000.0 && step.worst <= 2400.0, "step: {step:?}");
    let health = of("health-of-step");
    assert!(health.mean > 30.0 && health.mean <= 80.0 && health.worst <= 160.0, "health: {health:?}");
    for figure in counted.iter().filter(|figure| figure.name.starts_with("effect:")) {
        assert!(figure.mean < 600.0, "{figure:?}");
    }
    // What the first effect of a table costs beside itself: the shape's slopes and all that effects look at.
    let context = of("context-of-effects");
    assert!((100.0..250.0).contains(&context.mean), "context: {context:?}");
    for figure in [force, inverse, step] {
        assert!(figure.worst <= 1.5 * figure.mean, "{figure:?}");
    }
    assert!(of("table-image").mean <= 1024.0);
}

#[test]
fn single_precision_costs_less_than_a_hundredth_of_a_percent() {
    let one = figures::precision("example", &model_core::table::example());
    assert!(one.points > 50_000 && one.worst_percent < 0.01, "{one:?}");
    assert!(one.worst_percent > 1e-6, "single precision is compared with itself: {one:?}");
}

#[test]
fn both_images_fit_their_flash_and_their_memory() {
    let (Ok(sizes), Ok(stack)) = (memory::sizes(), memory::stack()) else { return };
    eprintln!("{}", memory::markdown(&sizes, stack));
    // Less would be a measurement that missed the store, whose futures alone take more than a half.
    assert!(stack > 1_000, "{stack} bytes of stack");
    for size in sizes {
        assert!(size.flash <= memory::FLASH && size.flash > memory::FLASH / 2, "{size:?}");
        assert!(size.memory(stack) <= memory::RAM, "{size:?} with {stack} bytes of stack");
    }
}

#[test]
fn roots_are_taken_in_hardware_and_nothing_is_computed_in_double() {
    let Ok(image) = machine::image() else { return };
    let bytes = std::fs::read(image).expect("an image");
    let elf = object::File::parse(&*bytes).expect("an image");
    // VSQRT.F32 by the ARMv7-M Architecture Reference Manual, encoding T1: halfwords 0xEEB1 and 0x0AC0; the bits outside the masks
    // select the registers.
    let roots: usize = elf
        .sections()
        .filter(|section| section.kind() == SectionKind::Text)
        .map(|section| {
            let code = section.data().expect("code");
            let halfword = |at: usize| u16::from_le_bytes([code[at], code[at + 1]]);
            let is_root =
                |at: &usize| halfword(*at) & 0xFFBF == 0xEEB1 && halfword(at + 2) & 0x0FD0 == 0x0AC0;
            (0..code.len().saturating_sub(3)).step_by(2).filter(is_root).count()
        })
        .sum();
    assert!(roots >= 1, "no root in hardware");
    let software = ["sqrt", "__aeabi_dadd", "__aeabi_dmul", "__aeabi_ddiv"];
    let found =
        elf.symbols().find(|s| s.name().is_ok_and(|name| software.iter().any(|bad| name.contains(bad))));
    assert!(found.is_none(), "{:?}", found.map(|symbol| symbol.name().map(str::to_owned)));
}
