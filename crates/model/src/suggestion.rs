//! "Did you mean": the nearest of the words allowed.

/// Words listed in full up to this many; beyond, only the nearest are.
const MAX_LISTED: usize = 12;

/// `did you mean a? allowed: a, b, c`, for a word that is not among them.
pub(crate) fn did_you_mean<'a>(word: &str, allowed: impl IntoIterator<Item = &'a str>) -> String {
    let mut ranked: Vec<(usize, &str)> = allowed
        .into_iter()
        .map(|candidate| (edit_distance(word, candidate), candidate))
        .collect();
    let listed = if ranked.len() <= MAX_LISTED {
        let words: Vec<&str> = ranked.iter().map(|&(_, w)| w).collect();
        format!("allowed: {}", words.join(", "))
    } else {
        ranked.sort_by_key(|&(distance, _)| distance);
        let words: Vec<&str> = ranked[..MAX_LISTED].iter().map(|&(_, w)| w).collect();
        format!("nearest of {}: {}", ranked.len(), words.join(", "))
    };
    let near = ranked.iter().min_by_key(|&&(distance, _)| distance);
    match near {
        Some(&(distance, best)) if distance <= best.chars().count().max(3) / 3 => {
            format!("did you mean {best}? {listed}")
        }
        _ => listed,
    }
}

/// Levenshtein distance in characters, without regard to case.
fn edit_distance(a: &str, b: &str) -> usize {
    // Hostile names are long; the answer only matters for short words.
    const LONGEST: usize = 64;
    let a: Vec<char> = a.to_lowercase().chars().take(LONGEST).collect();
    let b: Vec<char> = b.to_lowercase().chars().take(LONGEST).collect();
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, ca) in a.iter().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, cb) in b.iter().enumerate() {
            let substituted = diagonal + usize::from(ca != cb);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::{did_you_mean, edit_distance};

    #[test]
    fn identity_edit_distance_of_known_words() {
        assert_eq!(edit_distance("kitten", "sitting"), 3);
        assert_eq!(edit_distance("", "abc"), 3);
        assert_eq!(edit_distance("Mass", "mass"), 0);
    }

    #[test]
    fn identity_names_the_nearest_and_lists_all() {
        let text = did_you_mean("velocty", ["position", "velocity"]);
        assert_eq!(text, "did you mean velocity? allowed: position, velocity");
        assert_eq!(
            did_you_mean("zzz", ["position", "velocity"]),
            "allowed: position, velocity"
        );
    }
}
