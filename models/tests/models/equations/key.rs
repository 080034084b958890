//! Keys of the tables: names, and families such as `T[1..100]`, `T[i]`, `T[i=2..99]`.

use super::*;

/// Reads a model whose states are declared by one key, and whose derivatives are given by keys and expressions.
fn family(declared: &str, derivatives: &[(&str, &str)]) -> Result<Equations, StudyError> {
    let derivatives = derivatives.iter().map(|(key, of)| format!("'{key}' = '{of}'")).collect::<Vec<_>>().join(", ");
    read(&format!("states = {{ '{declared}' = '1' }}\nder = {{ {derivatives} }}"))
}

fn states(model: &Equations) -> Vec<String> {
    model.interface().states.iter().map(|state| state.name.clone()).collect()
}

#[test]
fn a_key_is_a_name_or_a_family() {
    let of = |declared: &str, defined: &str| states(&family(declared, &[(defined, "1")]).unwrap());
    assert_eq!(of("phi", "phi"), ["phi"]);
    assert_eq!(of("T[3]", "T[3]"), ["T[3]"]);
    assert_eq!(of("T[1..3]", "T[i]"), ["T[1]", "T[2]", "T[3]"]);
    let members = [("T[1]", "-T[1]"), ("T[ i = 2 .. 99 ]", "T[i-1] + T[i+1]"), ("T[i]", "2*T[i]")];
    let chain = family("T[1..100]", &members).unwrap();
    assert_eq!(states(&chain), (1..=100).map(|k| format!("T[{k}]")).collect::<Vec<_>>());
    let mut pattern = chain.plant_model().jacobian_pattern().to_vec();
    pattern.sort_unstable();
    let inside = (1..99).flat_map(|k| [(k, k - 1), (k, k + 1)]);
    assert_eq!(pattern, [(0, 0)].into_iter().chain(inside).chain([(99, 99)]).collect::<Vec<_>>());
    for (wrong, fact) in [
        ("phi-dot", "not a valid name"),
        ("2x", "not a valid name"),
        ("T[", "is invalid"),
        ("T[1..]", "is invalid"),
        ("T[i..3]", "is invalid"),
        ("T[3..1]", "expected 1 to 10000 members"),
        ("time", "reserved word"),
    ] {
        let mistake = family(wrong, &[(wrong, "1")]).err().expect(wrong).to_string();
        assert!(mistake.contains(fact), "{wrong}: {mistake}");
    }
}
