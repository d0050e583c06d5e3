use super::*;
use crate::criteria::baseline::{CACHED_ROWS, PRODUCT_PART};

#[test]
fn columns_that_are_zero_on_most_rows_make_the_same_basis() {
    let mut random = Random(3);
    let stretch = |from: usize, to: usize| -> Vec<f64> {
        (0..90).map(|i| if (from..to).contains(&i) { 1.0 + i as f64 } else { 0.0 }).collect()
    };
    let (first, second) = (stretch(10, 20), stretch(20, 35));
    let whole: Vec<f64> = (0..90).map(|_| random.normal()).collect();
    let y: Vec<f64> = (0..90).map(|i| 2.0 * first[i] - 3.0 * second[i] + 0.5 * whole[i]).collect();
    let ones = vec![1.0; 90];
    for columns in [[&first, &second, &whole], [&whole, &second, &first]] {
        let basis = Basis::new(&columns.map(Vec::clone), &ones);
        let mut by_stretches = Basis::default();
        for c in columns {
            let at = |v: &f64| *v != 0.0;
            let (from, to) = (c.iter().position(at), c.iter().rposition(at));
            let (from, to) = (from.expect("not zero"), to.expect("not zero") + 1);
            assert!(by_stretches.push_stretch(from, c[from..to].to_vec(), 90));
        }
        for (a, b) in by_stretches.solve(&y).iter().zip(basis.solve(&y)) {
            assert!((a - b).abs() < 1e-12);
        }
        let found = basis.solve(&y);
        let expected = columns.map(|c| {
            if *c == first {
                2.0
            } else if *c == second {
                -3.0
            } else {
                0.5
            }
        });
        for (a, b) in found.iter().zip(expected) {
            assert!((a - b).abs() < 1e-9, "{found:?}");
        }
        let (mut rest, along) = (y.clone(), basis.along(&y));
        basis.project_out(&mut rest);
        assert!(energy(&rest) < 1e-16 * energy(&y));
        assert!((energy(&along) - energy(&y)).abs() < 1e-9 * energy(&y));
        for (q, c) in basis.columns(0, 90).iter().zip(along) {
            assert!((energy(q) - 1.0).abs() < 1e-12 && (dot(q, &y) - c).abs() < 1e-9 * energy(&y).sqrt());
        }
    }
}

#[test]
fn products_by_blocks_are_those_of_whole_columns() {
    let mut random = Random(5);
    let n = PRODUCT_PART + 3 * CACHED_ROWS + 17;
    let column = |random: &mut Random| (0..n).map(|_| random.normal()).collect::<Vec<f64>>();
    let (a, b, v) = (column(&mut random), column(&mut random), column(&mut random));
    let (from, to) = (CACHED_ROWS - 3, PRODUCT_PART + 5);
    let columns = [Stretch::whole(&a), Stretch { from, values: &b[from..to] }];
    let found = products(&columns, &v);
    let whole: Vec<f64> = (0..n).map(|i| if (from..to).contains(&i) { b[i] } else { 0.0 }).collect();
    for (got, want) in found.iter().zip([dot(&a, &v), dot(&whole, &v)]) {
        assert!((got - want).abs() < 1e-9, "{got} {want}");
    }
    let mut sum = v.clone();
    add_all(&mut sum, &[2.0, -3.0], &columns);
    for i in 0..n {
        assert!((sum[i] - (v[i] + 2.0 * a[i] - 3.0 * whole[i])).abs() < 1e-12, "row {i}");
    }
}

#[test]
fn nearly_dependent_columns_make_an_orthonormal_basis() {
    let n = 3 * CACHED_ROWS;
    let t: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
    // Powers of a number between 0 and 1: the ninth differs from the others by a millionth of itself.
    let columns: Vec<Vec<f64>> = (0..9).map(|k| t.iter().map(|t| t.powi(k)).collect()).collect();
    let basis = Basis::new(&columns, &vec![1.0; n]);
    assert_eq!(basis.rank(), 9);
    let q = basis.columns(0, n);
    for (i, a) in q.iter().enumerate() {
        for (j, b) in q.iter().enumerate() {
            let want = f64::from(u8::from(i == j));
            assert!((dot(a, b) - want).abs() < 1e-12, "{i} {j}: {}", dot(a, b));
        }
    }
}

#[test]
fn coefficients_of_an_exact_combination_come_back_and_dependent_columns_are_left_out() {
    let n = 200;
    let t: Vec<f64> = (0..n).map(|i| i as f64 / n as f64).collect();
    let columns = vec![
        vec![1.0; n],
        t.clone(),
        t.iter().map(|v| 2.0 * v - 1.0).collect(),
        t.iter().map(|v| v * v * v).collect(),
    ];
    let w: Vec<f64> = t.iter().map(|v| 0.5 + v).collect();
    let basis = Basis::new(&columns, &w);
    assert_eq!(basis.rank(), 3);
    let y: Vec<f64> = t.iter().map(|v| 3.0 - 2.0 * v + 0.7 * v.powi(3)).collect();
    let c = basis.solve(&weighted(&y, &w));
    for (got, want) in c.iter().zip([3.0, -2.0, 0.0, 0.7]) {
        assert!((got - want).abs() < 1e-9, "{c:?}");
    }
}

#[test]
fn amplitudes_keep_their_signs() {
    // r = 2 a − b with nearly parallel a and b: without b allowed below zero, a alone must serve.
    let gram = vec![vec![1.0, 0.9], vec![0.9, 1.0]];
    let moment = vec![2.0 - 0.9, 1.8 - 1.0];
    let (free, gain_free) = amplitudes(&gram, &moment, &[Sign::Free, Sign::Free], 2);
    assert!((free[0] - 2.0).abs() < 1e-9 && (free[1] + 1.0).abs() < 1e-9);
    let (signed, gain) = amplitudes(&gram, &moment, &[Sign::Positive, Sign::Positive], 2);
    assert!((signed[0] - 1.1).abs() < 1e-9 && signed[1] == 0.0 && gain < gain_free);
}
