//! Pulses of an on/off valve, and the readings that ring after them.

pam_data::criteria! {
    "Valve pulses":
    /// A settled point begins at this share of the pulse period.
    WINDOW_FROM: f64 = 0.70, "w_1", "1", Derived("after the ring of a pulse of 0.5 s");
    /// A settled point ends at this share of the pulse period.
    WINDOW_TO: f64 = 0.94, "w_2", "1", Derived("before the next pulse");
    /// A valve's pulse and the ring of gas and bench after it are over by then.
    RING_TIME: f64 = 0.35, "t_ring", "s", Measured("two public sets of staircases: pulses of 5 to 60 ms, then 20 Hz for 0.2 to 0.3 s");
    /// Least autocorrelation of |dP/dt| at a pulse period.
    LEAST_PERIODICITY: f64 = 0.15, "r_p", "1", Derived("well above 2/√n of the shortest run");
    /// The first peak of the autocorrelation with this share of the highest is the period: multiples of a period correlate almost as well.
    PULSE_PEAK: f64 = 0.8, "r/r_max", "1", Judgement;
    /// A pulse changes the pressure within this part of the period.
    NARROW_PART: f64 = 0.25, "q_pulse", "1", Measured("the same sets: 70 to 85 % of |dP/dt| lies in a quarter of the period");
    /// ... where more of |dP/dt| lies there than a sine has, by this share of the rest.
    CONCENTRATED: f64 = 0.33, "c_pulse", "1", Judgement;
    /// Shortest and longest pulse period looked for, s.
    PULSE_PERIODS: ((f64, f64)) = (0.2, 5.0), "T_pulse", "s", Judgement;
    /// The period is refined in steps of this part of the grid.
    PULSE_FINE_STEP: f64 = 0.02, "dT/dt", "1", Judgement;
    /// ... by this many steps to both sides.
    PULSE_FINE_STEPS: (i32) = 50, "n_fine", "1", Derived("one grid step");
    /// The grid on which the period is looked for is no finer than this, s.
    PULSE_GRID: f64 = 0.01, "dt_pulse", "s", Judgement;
    /// Longest series whose period is looked for, in grid steps.
    PULSE_STEPS: usize = 6_000, "N_pulse", "1", Cost;
    /// Bins of a period, at most.
    PULSE_BINS: usize = 20, "n_pulse", "1", Judgement;
    /// The pulse begins a bin before the steepest one where that bin has this share of it.
    PULSE_BEGINS: f64 = 0.3, "q_before", "1", Judgement;
}
