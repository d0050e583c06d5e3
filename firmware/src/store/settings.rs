//! Settings on flash: whether what is read is what was written, and what layouts of before are taken over.
//!
//! The map below gives out the last item of a key whose own check sum is right: if the newest is damaged, that is the one before,
//! silently. Limits of before, or none, must not come into force unseen, so a seal in an item of its own says which settings are to
//! be expected: the sum of their bytes. While they are being written it names the old and the new, so that a power cut leaves either.
//! A device writes its settings at its very first start; where the layout's number is kept and no settings are, they are lost. A store
//! that had to be erased therefore begins with that number.

use embedded_storage_async::nor_flash::NorFlash;
use model_core::check::crc32;
use model_core::fields;
use model_core::fields::{Fields, Walk};
use model_core::link::messages::StoreFault;
use model_core::link::settings::Settings;

use super::{FORMAT, Store};

/// Key of the settings; 0x30 to 0x33 and 0x35 to 0x37 held those of the layouts 1 to 7.
const SETTINGS: u8 = 0x38;
const SEAL: u8 = 0x34;
const LAYOUT: u8 = 0x3F;
const SETTINGS_7: u8 = 0x37;
const SETTINGS_6: u8 = 0x36;
const SETTINGS_5: u8 = 0x35;
const SETTINGS_4: u8 = 0x33;
const SETTINGS_3: u8 = 0x32;
const SETTINGS_2: u8 = 0x31;
const SETTINGS_1: u8 = 0x30;
/// Longest settings.
const ROOM: usize = 400;

/// What kind of settings were kept.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Kept {
    /// None: a new device.
    None,
    /// Those of this layout.
    Whole,
    /// Those of an older layout, taken over field by field; fields that it did not know are the board's own.
    Older,
    /// There were some, and they are damaged or of a layout that is not known.
    Untrusted,
}

/// Which settings are to be expected.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Seal {
    /// Sum of the settings in force.
    current: u32,
    /// Sum of those before, while they are replaced.
    previous: Option<u32>,
}

fields!(Seal { current, previous });

impl Seal {
    /// Whether settings of this sum are to be expected.
    fn names(&self, sum: u32) -> bool {
        sum == self.current || Some(sum) == self.previous
    }
}

/// Sum of what lies under a key; nothing has none.
fn sum_of(bytes: Option<&[u8]>) -> u32 {
    bytes.map_or(0, |bytes| crc32(bytes).max(1))
}

/// Settings of an older layout.
struct Older<'s> {
    settings: &'s mut Settings,
    /// Number of the layout: the regulator has a line since 3, a hold and a vent have their watches since 4, an armed device since 5.
    /// Sensors and command have scales since 6, and further inputs are watched. A pair of valves is possible since 7, a CAN bus
    /// since 8.
    layout: u16,
}

impl Fields for Older<'_> {
    fn walk(&mut self, walk: &mut Walk<'_>) {
        let Settings {
            feed_forward,
            force_loop,
            stroke_loop,
            joint,
            regulator,
            limits,
            pressure,
            stroke,
            force,
            watch,
            hold_on,
            motion_band_m,
            pressure_band_pa,
            scales,
            command,
            valves,
            can: _,
        } = &mut *self.settings;
        feed_forward.walk(walk);
        force_loop.walk(walk);
        stroke_loop.walk(walk);
        joint.walk(walk);
        regulator.gain.walk(walk);
        regulator.offset_pa.walk(walk);
        regulator.lag_s.walk(walk);
        if self.layout >= 3 {
            regulator.line_s.walk(walk);
        }
        regulator.rate_pa_per_s.walk(walk);
        regulator.deadband_pa.walk(walk);
        regulator.command_max_pa.walk(walk);
        regulator.lead.walk(walk);
        limits.walk(walk);
        pressure.walk(walk);
        stroke.walk(walk);
        force.walk(walk);
        watch.debounce_ticks.walk(walk);
        watch.noisy_jumps.walk(walk);
        watch.disagree_n.walk(walk);
        watch.disagree_ticks.walk(walk);
        watch.follow_pa.walk(walk);
        watch.follow_ticks.walk(walk);
        watch.silence_ticks.walk(walk);
        watch.host_silence_ticks.walk(walk);
        watch.autonomous.walk(walk);
        watch.overrun_ticks.walk(walk);
        if self.layout >= 4 {
            watch.hold_ticks.walk(walk);
            watch.vented_pa.walk(walk);
            watch.vent_ticks.walk(walk);
            watch.valve_test_pa.walk(walk);
        }
        if self.layout >= 5 {
            watch.armed_silence_ticks.walk(walk);
        }
        if self.layout >= 6 {
            watch.second_pressure_pa.walk(walk);
            watch.supply_low_pa.walk(walk);
            watch.enable_input.walk(walk);
        }
        hold_on.walk(walk);
        motion_band_m.walk(walk);
        pressure_band_pa.walk(walk);
        if self.layout >= 6 {
            scales.walk(walk);
            command.walk(walk);
        }
        if self.layout >= 7 {
            valves.walk(walk);
        }
    }
}

impl<F: NorFlash> Store<F> {
    /// Reads the kept settings into a place that holds the board's own; where they cannot be read whole, the board's own stay.
    ///
    /// # Errors
    /// [`StoreFault::Medium`].
    pub fn settings(&mut self, settings: &mut Settings) -> Result<Kept, StoreFault> {
        let layout = self.value::<u16>(LAYOUT)?;
        let seal = self.value::<Seal>(SEAL)?;
        let own = *settings;
        let sealed = |bytes: Option<&[u8]>| seal.is_some_and(|seal| seal.names(sum_of(bytes)));
        if let Some(bytes) = self.bytes(SETTINGS)? {
            if sealed(Some(bytes))
                && layout.is_none_or(|layout| layout <= FORMAT)
                && fields::read(bytes, settings)
            {
                return Ok(Kept::Whole);
            }
            *settings = own;
            return Ok(Kept::Untrusted);
        }
        if layout.is_some_and(|layout| layout >= FORMAT) {
            return Ok(Kept::Untrusted);
        }
        // The layouts from 4 on have a seal.
        let mut last = SETTINGS_4;
        for key in [SETTINGS_5, SETTINGS_6, SETTINGS_7] {
            if self.bytes(key)?.is_some() {
                last = key;
            }
        }
        let bytes = self.bytes(last)?;
        if bytes.is_none() && (layout.is_some() || (seal.is_some() && !sealed(None))) {
            return Ok(Kept::Untrusted);
        }
        if bytes.is_some_and(|bytes| !sealed(Some(bytes))) {
            return Ok(Kept::Untrusted);
        }
        let older = [
            (SETTINGS_7, 7),
            (SETTINGS_6, 6),
            (SETTINGS_5, 5),
            (SETTINGS_4, 4),
            (SETTINGS_3, 3),
            (SETTINGS_2, 2),
        ];
        for (key, layout) in older {
            if let Some(bytes) = self.bytes(key)? {
                if fields::read(bytes, &mut Older { settings, layout }) {
                    return Ok(Kept::Older);
                }
                *settings = own;
                return Ok(Kept::Untrusted);
            }
        }
        Ok(if self.bytes(SETTINGS_1)?.is_some() { Kept::Untrusted } else { Kept::None })
    }

    /// Keeps settings.
    ///
    /// # Errors
    /// As the medium fails; the settings before stay in force then.
    pub fn put_settings(&mut self, settings: &mut Settings) -> Result<(), StoreFault> {
        let mut room = [0; ROOM];
        let length = fields::write(settings, &mut room).ok_or(StoreFault::Full)?;
        let bytes = &room[..length];
        let mut before = 0;
        for key in [SETTINGS_4, SETTINGS_5, SETTINGS_6, SETTINGS_7, SETTINGS] {
            if let Some(bytes) = self.bytes(key)? {
                before = sum_of(Some(bytes));
            }
        }
        let current = sum_of(Some(bytes));
        // Where the newest settings were damaged, what is read is those before them: after a power cut, no more to be trusted than now.
        let trusted = self.value::<Seal>(SEAL)?.is_none_or(|seal| seal.names(before));
        self.put_value(SEAL, &mut Seal { current, previous: trusted.then_some(before) })?;
        self.put_bytes(SETTINGS, bytes)?;
        self.put_value(SEAL, &mut Seal { current, previous: None })?;
        if self.value::<u16>(LAYOUT)? != Some(FORMAT) {
            self.put_layout()?;
        }
        if self.bytes(SETTINGS)? == Some(bytes) { Ok(()) } else { Err(StoreFault::Verify) }
    }
    /// Marks the flash as a store of this layout: without settings, they are lost.
    ///
    /// # Errors
    /// As the medium fails.
    pub(super) fn put_layout(&mut self) -> Result<(), StoreFault> {
        self.put_value(LAYOUT, &mut { FORMAT })
    }
}
