//! Filters that all channels passed through.

pam_data::criteria! {
    "Filtered channels":
    /// Strokes on both sides of a reversal have at least this many rows each.
    FILTER_ROWS: usize = 8, "N_stroke", "1", Derived("four numbers are fitted to half of the rows on both sides");
    /// Rows on each side of a reversal that show how friction turns, at most.
    FILTER_WINDOW: usize = 40, "N_window", "1", Cost;
    /// Reversals that are examined, spread evenly, at most.
    FILTER_REVERSALS: usize = 200, "N_rev", "1", Cost;
    /// Fewest reversals that show a filter.
    FILTER_FEWEST: usize = 6, "N_rev,min", "1", Derived("the sign of six differences is the same by chance in 3 % of the cases");
    /// Times over which friction turns, tried, as multiples of the time from row to row.
    FILTER_WIDTHS: ([f64; 10]) = [1.0, 1.5, 2.0, 3.0, 4.0, 6.0, 8.0, 12.0, 16.0, 24.0], "w/dt", "1", Derived("factors of about 1.4");
    /// Factors by which the best width is varied, coarse and fine.
    FILTER_NEARBY: ([[f64; 4]; 2]) = [[0.8, 0.9, 1.12, 1.25], [0.94, 0.97, 1.03, 1.06]], "f", "1", Derived("halves the grid's distances twice");
    /// The channels were filtered where that leaves less than this share of the error of each law of friction that turns after the reversal.
    FILTER_LEAVES: f64 = 0.7, "S_filter/S_0", "1", Measured("40 development trials leave 0.89 and more; loops filtered with 0.3 to 1.5 s leave 0.0 to 0.6, 13 of 14");
    /// A row is judged once friction is within this of its full direction.
    FILTER_TURNED: f64 = 0.05, "1 - z_filter", "1", Judgement;
    /// As many times more rows are left out on either side: where the filter has another form, its response ends later.
    FILTER_MARGIN: f64 = 1.5, "f_margin", "1", Judgement;
}
