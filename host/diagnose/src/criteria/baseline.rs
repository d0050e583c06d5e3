//! The base model: orders, limits, priors.

pam_data::criteria! {
    "Base model":
    /// Elastic orders of the production table.
    TABLE_ORDER: usize = 4, "M", "1", Trials("four orders leave 0.03 to 0.06 % of the blocked force on a hyperelastic wall");
    /// The highest elastic order that is ever offered.
    ORDERS: (usize) = 6, "M_max", "1", Judgement;
    /// Columns of a hyperelastic (Yeoh) wall.
    YEOH: (usize) = 3, "n_Y", "1", Published("O. H. Yeoh, Rubber Chemistry and Technology 66 (1993) 754-771, doi 10.5254/1.3538343");
    /// Near full contraction the force falls as at a wall where one bladder of many orders leaves less than the tables, which have few, by
    /// this root mean square, in blocked forces.
    WALL: f64 = 1e-3, "e_wall/F_b", "1", Trials("at most 0.6e-3 in 60 campaigns without an effect, 1.3e-3 to 3.9e-3 where strands jam at 4 to 6 %");
    /// A direction of the flexible tables counts where it differs from the others by this share of itself.
    DISTINCT_DIRECTION: f64 = 1e-3, "d_soft", "1", Judgement;
    /// A column that differs from a basis by less than this share of itself lies in it.
    DEPENDENT_COLUMN: f64 = 1e-7, "d_hard", "1", Derived("the square root of the rounding error of a sum over 24 000 rows");
    /// Rows of a part of a product that threads share. The parts do not depend on the number of threads, so the sum does not either.
    PRODUCT_PART: usize = 65536, "n_part", "1", Cost;
    /// Rows of a block of many products: a column's block stays in the first-level cache (16 KiB) while all others pass it.
    CACHED_ROWS: usize = 2048, "n_block", "1", Cost;
    /// Rounds of linearising the friction: first fit, and from an earlier fit.
    LINEARISATIONS: ((usize, usize)) = (4, 3), "n_lin", "1", Judgement;
    /// Friction coefficients are kept within these limits while iterating.
    FRICTION_LIMITS: ((f64, f64)) = (-0.4, 0.8), "k_F", "1", Judgement;
    /// Powers of pressure in the friction of one bladder for all pressures, at most.
    FRICTION_POWERS: usize = 3, "n_k", "1", Judgement;
    /// Elastic orders whose stiffness may change in proportion to the pressure, where one bladder for all pressures is allowed that.
    STIFFENING_ORDERS: usize = 2, "M_P", "1", Judgement;
    /// The powers are held constant this far beyond the tested range, in half-ranges.
    FRICTION_RANGE: f64 = 1.2, "u_max", "1", Judgement;
    /// Free tables: prior deviation of elastic surface and friction, in blocked forces; large enough that it does not bind.
    FREE_DEVIATION: f64 = 1e3, "V_free/F_b", "1", Derived("a thousand blocked forces bind nothing");
    /// Free tables: deviation of a row, in blocked forces.
    FREE_ROW: f64 = 1e-3, "s_free/F_b", "1", Judgement;
    /// Elastic surface and friction differ between pressures by this at first, in blocked forces.
    FIRST_DEVIATIONS: ((f64, f64)) = (1e-3, 5e-4), "V_1/F_b", "1", Judgement;
    /// Deviations of the elastic surface between pressures that are compared, in blocked forces.
    ELASTIC_DEVIATIONS: ([f64; 6]) = [1e-4, 3e-4, 1e-3, 3e-3, 1e-2, 3e-2], "V_e/F_b", "1", Derived("half decades from noise to a wholly different bladder");
    /// The same of the friction.
    FRICTION_DEVIATIONS: ([f64; 4]) = [1e-4, 5e-4, 2.5e-3, 1e-2], "V_f/F_b", "1", Derived("factors of about five over the same range");
    /// Their expected values (elastic, friction); the prior is normal in the logarithm with a deviation of 1/sqrt 2.
    EXPECTED_DEVIATIONS: ((f64, f64)) = (7e-4, 3e-4), "V_0/F_b", "1", Judgement;
}
