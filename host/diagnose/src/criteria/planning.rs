//! The next experiment, and what a planned protocol shows.

pam_data::criteria! {
    "Next experiment, protocol simulation":
    /// A difference below this share of the noise is not worth an experiment.
    WORTHWHILE_DIFFERENCE: f64 = 0.3, "dF/s", "1", Judgement;
    /// Noise that is reckoned with at least, in blocked forces.
    EXPECTED_NOISE: f64 = 1e-3, "s/F_b", "1", Judgement;
    /// Traces with this cosine, once the tables are refitted, cannot be distinguished.
    INDISTINGUISHABLE: f64 = 0.9, "cos", "1", Convention("26 degrees; the catalogue's classes are made with it");
    /// Rows at most on which a protocol is judged.
    PROTOCOL_ROWS: usize = 12_000, "N_prot", "1", Cost;
    /// Samples of a simulated protocol, at most.
    PROTOCOL_SAMPLES: usize = 400_000, "N_max", "1", Cost;
    /// A protocol is simulated at this rate at most.
    PROTOCOL_RATE: f64 = 10.0, "f_s,max", "Hz", Cost;
    /// Rate of a pressure whose protocol states none.
    PROTOCOL_PRESSURE_RATE: f64 = 1e3, "dP/dt_0", "kPa/s", Judgement;
    /// Powers of pressure in the tables that a protocol is judged against.
    PLAN_POWERS: (i32) = 3, "n_plan", "1", Judgement;
    /// Grid points of a competitor's only shape.
    COMPETITOR_GRID: usize = 5, "n_1", "1", Cost;
    /// Grid points of each of several shapes of a competitor.
    COMPETITOR_GRID_SEVERAL: usize = 3, "n_2", "1", Cost;
    /// Time of a slow half-stroke over the free stroke.
    SLOW_STROKE: f64 = 27.0, "t_slow", "s", Judgement;
    /// Low and high pressure of the menu, as shares of the range.
    MENU_PRESSURES: ([f64; 2]) = [0.35, 0.9], "P_menu", "1", Judgement;
    /// Largest contraction that is searched for the free stroke, least and most.
    FREE_STROKE: ((f64, f64)) = (0.01, 0.6), "eps_free", "1", Judgement;
    /// Sampling rate of a proposed recording.
    MENU_SAMPLES: f64 = 20.0, "f_s", "Hz", Judgement;
    /// Duration of a tare before and after.
    MENU_TARE: f64 = 10.0, "t_tare", "s", Judgement;
    /// Rate of the pressure between two levels.
    MENU_PRESSURE_RATE: f64 = 50.0, "dP/dt", "kPa/s", Judgement;
    /// Time for which a pressure settles.
    MENU_SETTLE: f64 = 2.0, "t_set", "s", Judgement;
    /// Largest stroke of loops, as a part of the free stroke: short of a slack muscle.
    MENU_PART: f64 = 0.9, "x_max/x_free", "1", Judgement;
    /// Speeds of the recording at several speeds as multiples of the slow one, and loops at each.
    MENU_SPEEDS: ([(f64, u32); 4]) = [(0.3, 1), (1.0, 2), (4.0, 2), (16.0, 2)], "v/v_slow", "1", Judgement;
    /// Speed between the holds, as a multiple of the slow one.
    MENU_DWELL_SPEED: f64 = 2.0, "v_dwell/v_slow", "1", Judgement;
    /// Durations of the holds, one a decade.
    MENU_DWELLS: ([f64; 3]) = [1.0, 10.0, 100.0], "t_hold", "s", Judgement;
    /// Place of the holds, as a part of the free stroke.
    MENU_DWELL_AT: f64 = 0.5, "x_hold/x_free", "1", Judgement;
    /// Places at which the stroke turns between holds, so that they are reached from both sides.
    MENU_DWELL_TURNS: ([f64; 2]) = [0.9, 0.1], "x_turn/x_free", "1", Judgement;
    /// Places at which nested loops turn.
    MENU_NESTED: ([f64; 8]) = [0.9, 0.25, 0.75, 0.4, 0.6, 0.25, 0.9, 0.0], "x_nest/x_free", "1", Judgement;
    /// Speeds of nested loops, as multiples of the slow one.
    MENU_NESTED_SPEEDS: ([f64; 2]) = [1.0, 8.0], "v_nest/v_slow", "1", Judgement;
    /// Time over which a ramp would reach its pressure from zero.
    MENU_RAMP_TIME: f64 = 20.0, "P/(dP/dt)", "s", Judgement;
    /// Ends of pressure ramps at a held length.
    MENU_RAMPS: ([f64; 4]) = [0.4, 1.0, 0.4, 1.0], "P_ramp/P", "1", Judgement;
    /// Held lengths of the ramps.
    MENU_RAMP_LENGTHS: ([f64; 3]) = [0.0, 0.3, 0.6], "x_ramp/x_free", "1", Judgement;
    /// Speed between the held lengths.
    MENU_RAMP_SPEED: f64 = 4.0, "v_ramp/v_slow", "1", Judgement;
    /// Rest between two like recordings.
    MENU_REST: f64 = 1800.0, "t_rest", "s", Judgement;
    /// Loops before and after the rest.
    MENU_REST_LOOPS: u32 = 3, "n_loop", "1", Judgement;
    /// What the recordings cost: speeds, dwells, nested loops, pressure ramps, rest.
    MENU_MINUTES: ([f64; 5]) = [8.0, 10.0, 6.0, 9.0, 38.0], "t_menu", "min", Derived("durations of the protocols with the way between them, rounded");
}
