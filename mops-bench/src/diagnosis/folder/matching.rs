//! Assignment of equations to states.

/// Returns the states whose derivatives occur in an equation, as `w'` or `der(w)`.
fn derivatives(equation: &str, states: &[String]) -> Vec<usize> {
    let name = |c: char| c.is_alphanumeric() || c == '_';
    let occurs = |state: &str| {
        equation.match_indices(state).any(|(at, _)| {
            let (before, after) = (&equation[..at], equation[at + state.len()..].trim_start());
            let whole = !before.ends_with(name) && !equation[at + state.len()..].starts_with(name);
            whole && (after.starts_with('\'') || before.trim_end().ends_with("der(") && after.starts_with(')'))
        })
    };
    (0..states.len()).filter(|&i| occurs(&states[i])).collect()
}

/// Assigns to every state an equation that contains its derivative. Among several possible assignments, the pairs of
/// state and equation in `meant` (indices) have priority, then the order.
///
/// # Errors
/// If the numbers of states and equations differ, or no assignment exists.
pub(super) fn matched<'e>(
    states: &[String],
    equations: &'e [String],
    meant: &[(usize, usize)],
) -> Result<Vec<&'e str>, String> {
    if states.len() != equations.len() {
        return Err(format!("expected {} equations, one per state, found {}", states.len(), equations.len()));
    }
    let mut choices: Vec<Vec<usize>> = equations.iter().map(|e| derivatives(e, states)).collect();
    for (equation, choice) in choices.iter_mut().enumerate() {
        choice.sort_by_key(|&state| !meant.contains(&(state, equation)));
    }
    let mut owner = vec![None; states.len()];
    if !assign(0, &choices, &mut owner) {
        return Err("the equations cannot be assigned to the states, one each".to_owned());
    }
    Ok(owner.into_iter().map(|e| equations[e.expect("all are assigned")].as_str()).collect())
}

/// Assigns the equations from index `equation` on, with backtracking.
fn assign(equation: usize, choices: &[Vec<usize>], owner: &mut [Option<usize>]) -> bool {
    let Some(possible) = choices.get(equation) else { return true };
    for &state in possible {
        if owner[state].is_none() {
            owner[state] = Some(equation);
            if assign(equation + 1, choices, owner) {
                return true;
            }
            owner[state] = None;
        }
    }
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(all: &[&str]) -> Vec<String> {
        all.iter().map(|&s| s.to_owned()).collect()
    }

    #[test]
    fn coupled_equations_are_matched_by_meaning_and_otherwise_in_order() {
        let states = texts(&["th", "thd", "ph", "phd"]);
        let equations = texts(&["th' = thd", "ph' = phd", "a*thd' + c*phd' = 0", "c*thd' + b*phd' = u"]);
        let in_order = ["th' = thd", "a*thd' + c*phd' = 0", "ph' = phd", "c*thd' + b*phd' = u"];
        assert_eq!(matched(&states, &equations, &[]).unwrap(), in_order);
        let swapped = matched(&states, &equations, &[(3, 2), (1, 3)]).unwrap();
        assert_eq!((swapped[1], swapped[3]), (in_order[3], in_order[1]));
    }

    #[test]
    fn an_equation_is_reserved_for_the_only_state_that_it_fits() {
        let states = texts(&["x", "y"]);
        let equations = texts(&["der(x) + der( y ) = 1", "x' = y"]);
        assert_eq!(matched(&states, &equations, &[]).unwrap(), ["x' = y", "der(x) + der( y ) = 1"]);
        assert!(matched(&states, &texts(&["x' = 1", "x' = y"]), &[]).is_err());
        assert!(matched(&states, &texts(&["x' = 1"]), &[]).is_err());
        // `xx'` is not the derivative of `x`.
        assert!(matched(&texts(&["x"]), &texts(&["xx' = 1"]), &[]).is_err());
    }
}
