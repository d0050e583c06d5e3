//! Where the error is: along coordinates, and in time.

pam_data::criteria! {
    "Location of the error":
    /// Bins along a coordinate.
    BINS: usize = 12, "n_bin", "1", Judgement;
    /// Values of a coordinate that are bins of their own, at most, in bins.
    DISCRETE_BINS: usize = 4, "n_value/n_bin", "1", Judgement;
    /// Shuffles of the blocks behind a p-value of a region.
    REGION_SHUFFLES: usize = 199, "n_shuffle", "1", Derived("p = 0.05 is then known to 0.015");
    /// A region is reported up to this p of its coordinate. Of an error that lasts like noise it is the place up to this p of all
    /// coordinates together.
    REGION_ALPHA: f64 = 0.05, "p_region", "1", Convention("5 %");
    /// Regions reported at most.
    MOST_REGIONS: usize = 6, "n_region", "1", Cost;
    /// A region holds less than this share of the rows.
    REGION_ROWS: f64 = 0.85, "q_region", "1", Judgement;
    /// Variance of a share of rows, at least: a handful of rows is not a region.
    REGION_VARIANCE: f64 = 0.02, "var_min", "1", Judgement;
    /// Rows each way over which the residual is smoothed.
    REGION_SMOOTHING: usize = 2, "m_region", "1", Judgement;
    /// Share of the noise's variance that smoothing leaves.
    SMOOTHED_NOISE: f64 = 0.3, "s_smooth2/s2", "1", Derived("0.2 for independent rows, more for correlated ones");
    /// ... but of the smoothed residual's own mean square at most.
    SMOOTHED_NOISE_MOST: f64 = 0.5, "q_floor", "1", Judgement;
    /// Shuffles of the blocks behind the p-value of a line.
    LINE_SHUFFLES: usize = 99, "n_line", "1", Derived("p = 0.02 is then the second smallest");
    /// Rows of the longest stretch of a spectrum.
    LONGEST_STRETCH: usize = 1024, "N_fft", "1", Cost;
    /// Rows of the shortest one.
    SHORTEST_STRETCH: usize = 64, "N_fft,min", "1", Judgement;
    /// Stretches of a spectrum, at least.
    STRETCHES: usize = 8, "n_fft", "1", Judgement;
    /// A line's period is at most one of this many parts of a half-stroke.
    LINE_PERIODS: f64 = 4.0, "t_stroke/T", "1", Derived("what repeats with the strokes themselves is not a line");
    /// Frequencies on each side that a line is compared with.
    LINE_NEIGHBOURS: usize = 10, "m_line", "1", Judgement;
    /// Frequencies on each side that belong to it.
    LINE_WIDTH: usize = 2, "m_own", "1", Derived("half the main lobe of a Hann window");
}
