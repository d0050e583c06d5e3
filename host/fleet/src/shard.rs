//! A share of the muscles, by the hash of their names: the same on every machine, regardless of the order of the manifest.

use pam_data::error::{DataCode, Error};
use sha2::{Digest, Sha256};
use std::str::FromStr;

/// Shard `index` of `of`, counted from 1.
///
/// ```
/// use pam_fleet::Shard;
/// let shards: Vec<Shard> = ["1/3", "2/3", "3/3"].iter().map(|s| s.parse().unwrap()).collect();
/// assert_eq!(shards.iter().filter(|s| s.holds("mini-1")).count(), 1);
/// assert!("0/3".parse::<Shard>().is_err() && "4/3".parse::<Shard>().is_err());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    index: u32,
    of: u32,
}

impl Shard {
    /// All muscles.
    pub const WHOLE: Self = Self { index: 1, of: 1 };

    /// Whether a muscle belongs to this shard.
    #[must_use]
    pub fn holds(self, muscle: &str) -> bool {
        let hash = Sha256::digest(muscle.as_bytes());
        let number =
            u64::from_le_bytes([hash[0], hash[1], hash[2], hash[3], hash[4], hash[5], hash[6], hash[7]]);
        number % u64::from(self.of) == u64::from(self.index - 1)
    }
}

impl std::fmt::Display for Shard {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}/{}", self.index, self.of)
    }
}

impl FromStr for Shard {
    type Err = Error;

    fn from_str(text: &str) -> Result<Self, Error> {
        let numbers =
            text.split_once('/').and_then(|(i, n)| Some((i.trim().parse().ok()?, n.trim().parse().ok()?)));
        match numbers {
            Some((index, of)) if (1..=of).contains(&index) => Ok(Self { index, of }),
            _ => Err(Error::new(DataCode::CallInvalid, "a shard is written i/n, with i from 1 to n")
                .value(text)
                .help("for four shards give 1/4, 2/4, 3/4 and 4/4")),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_disjoint_complete_and_about_equal() {
        let names: Vec<String> = (0..4000).map(|i| format!("m-{i:04}")).collect();
        let shards: Vec<Shard> = (1..=4).map(|index| Shard { index, of: 4 }).collect();
        let mut sizes = [0; 4];
        for name in &names {
            let holders: Vec<usize> = (0..4).filter(|i| shards[*i].holds(name)).collect();
            assert_eq!(holders.len(), 1, "{name}");
            sizes[holders[0]] += 1;
        }
        // Binomial: 1000 ± 27 each.
        assert!(sizes.iter().all(|s| (880..1120).contains(s)), "{sizes:?}");
    }
}
