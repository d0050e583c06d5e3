//! Work taken in order by a few threads: what is done at any time is a beginning of the list, give or take what is in hand.

use rayon::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Do `work` for every item in order on the pool's threads; the first error ends it.
pub fn in_order<T: Sync, R: Send>(
    items: &[T],
    work: impl Fn(&T) -> Result<R, String> + Sync,
) -> Result<Vec<R>, String> {
    let next = AtomicUsize::new(0);
    let parts: Result<Vec<Vec<(usize, R)>>, String> = (0..rayon::current_num_threads())
        .into_par_iter()
        .with_max_len(1)
        .map(|_| {
            let mut done = Vec::new();
            loop {
                let i = next.fetch_add(1, Ordering::Relaxed);
                let Some(item) = items.get(i) else { return Ok(done) };
                done.push((i, work(item)?));
            }
        })
        .collect();
    let mut all: Vec<(usize, R)> = parts?.into_iter().flatten().collect();
    all.sort_by_key(|d| d.0);
    Ok(all.into_iter().map(|d| d.1).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn results_come_in_the_order_of_the_items_and_errors_come_out() {
        let items: Vec<u32> = (0..50).collect();
        assert_eq!(in_order(&items, |i| Ok(i * 2)), Ok((0..50).map(|i| i * 2).collect()));
        assert!(in_order(&items, |i| if *i == 7 { Err("seven".into()) } else { Ok(()) }).is_err());
    }
}
