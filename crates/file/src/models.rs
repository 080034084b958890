//! Models of a study file: of a kind, `like` another one, linearised, cut, or joined.

use mops_core::{
    catalogue::{Catalogue, schema_once},
    model::{Joined, Linearise, Linearised, Parameter, Variable},
    study::{ModelBuilder, StudyError},
};
use mops_language::{Diagnostic, suggestion};

use super::effects;
use super::reading::kind;
use super::sections::{ModelCommon, OneOrMore};
use super::tree::Node;
use mops_language::files::Files;

/// Reads a model of a study, whose models are `all`.
pub(super) fn read<'t>(
    catalogue: &Catalogue,
    all: &[(String, Node<'t>)],
    (name, node): (&str, &Node<'t>),
    files: &dyn Files,
) -> Result<ModelBuilder, Diagnostic> {
    let node = with_base(all, node, &mut vec![name.to_owned()])?;
    match node.child("join") {
        Some(join) => read_joined(catalogue, (all, name), &node, &join, files),
        None => read_model(catalogue, &node, files),
    }
}

/// Returns the table of a model with all keys of the model that it is `like`, unless it gives them itself.
fn with_base<'t>(all: &[(String, Node<'t>)], node: &Node<'t>, path: &mut Vec<String>) -> Result<Node<'t>, Diagnostic> {
    let Some(like) = node.child("like") else { return Ok(node.clone()) };
    let name: String = like.read()?;
    let names = || all.iter().map(|(name, _)| name.as_str());
    let Some((_, base)) = all.iter().find(|(known, _)| *known == name) else {
        return Err(like.diagnostic(format!("the study has no model `{name}`")).with_help(suggestion(&name, names())));
    };
    if path.contains(&name) {
        let fact = format!("circular `like`: {} -> {name}", path.join(" -> "));
        return Err(like.diagnostic(fact).with_help("one of these models must be defined without `like`"));
    }
    path.push(name);
    with_base(all, base, path)?.overlaid(node, "like")
}

pub(super) fn read_model(
    catalogue: &Catalogue,
    node: &Node<'_>,
    files: &dyn Files,
) -> Result<ModelBuilder, Diagnostic> {
    let (kind, options) = kind(node, ModelCommon::KEYS, &catalogue.models, |k| k.name, "model")?;
    let common: ModelCommon = node.only(ModelCommon::KEYS).read()?;
    if let Some(like) = &common.like {
        return Err(node
            .locate(&StudyError::new("like", format!("`{like}` is a model of a study, and this is a single model")))
            .with_help("give all keys of the model"));
    }
    let model = options.read_with(&schema_once(kind.schema), |value| (kind.read)(value, files))?;
    let mut model = model.map_err(|mistake| options.locate(&mistake))?;
    if let Some(place) = node.child("effects") {
        model = effects::add(catalogue, model, common.effects, &place)?;
    }
    let at_equilibrium = common.linearise.as_ref().and_then(|section| section.equilibrium).unwrap_or(true);
    let linearise = common.linearise.map(Linearise::from);
    if let Some(open) = common.open {
        let variables = match open {
            OneOrMore::One(variable) => vec![variable],
            OneOrMore::More(variables) => variables,
        };
        let options = Linearise { equilibrium: at_equilibrium, ..linearise.unwrap_or_default() };
        let linearised = Linearised::opened(model.as_ref(), &variables, options);
        model = Box::new(linearised.map_err(|mistake| node.locate(&mistake))?);
    } else if let Some(linearise) = linearise {
        let place = node.child("linearise").expect("it was just read");
        model = Box::new(Linearised::new(model.into(), &linearise).map_err(|mistake| place.locate(&mistake))?);
    }
    Ok(ModelBuilder { model, parameters: common.parameters.0 })
}

/// Reads the models that are joined as `own`, and joins them.
fn read_joined(
    catalogue: &Catalogue,
    (all, own): (&[(String, Node<'_>)], &str),
    node: &Node<'_>,
    join: &Node<'_>,
    files: &dyn Files,
) -> Result<ModelBuilder, Diagnostic> {
    let allowed = ["join", "parameters"];
    if let Some((_, other)) = node.entries()?.into_iter().find(|(key, _)| !allowed.contains(&key.as_str())) {
        let fact = "a joined model has no keys but `join` and `parameters`".to_owned();
        return Err(other.key_diagnostic(fact).with_help("move it to one of the models that are joined"));
    }
    let common: ModelCommon = node.only(ModelCommon::KEYS).read()?;
    let mut models = Vec::new();
    let mut parameters = common.parameters.0;
    let mut values: Vec<(Variable, f64)> = Vec::new();
    let given: Vec<String> = parameters.iter().map(|(name, _)| name.clone()).collect();
    for name in common.join.unwrap_or_default() {
        let names = || all.iter().map(|(name, _)| name.as_str()).filter(|name| *name != own);
        let Some((_, base)) = all.iter().find(|(known, _)| *known == name && name != own) else {
            let fact = format!("the study has no other model `{name}`");
            return Err(join.diagnostic(fact).with_help(suggestion(&name, names())));
        };
        if models.iter().any(|(known, _)| *known == name) {
            return Err(join.diagnostic(format!("`{name}` is joined twice")).with_help("remove one of them"));
        }
        let base = with_base(all, base, &mut vec![name.clone()])?;
        if base.child("join").is_some() {
            let fact = format!("`{name}` is itself a joined model");
            return Err(join.diagnostic(fact).with_help("list the models that it joins"));
        }
        let part = read_model(catalogue, &base, files)?;
        for Parameter { variable, default, .. } in &part.model.interface().parameters {
            let own = part.parameters.iter().find(|(known, _)| *known == variable.name).map(|(_, value)| value);
            if let Some(own) = own.filter(|_| !parameters.iter().any(|(known, _)| *known == variable.name)) {
                parameters.push((variable.name.clone(), own.clone()));
            }
            // A value in a wrong unit is refused when the study is built.
            if let Some(value) = own.map_or(*default, |own| own.to(&variable.unit).ok()).filter(|v| !v.is_nan()) {
                values.push((variable.clone(), value));
            }
        }
        models.push((name, part.model));
    }
    let differs = |(variable, value): &&(Variable, f64)| {
        let is_other = |(other, known): &(Variable, f64)| {
            other.name == variable.name
                && other.unit.convert(*known, &variable.unit).is_some_and(|known| known != *value)
        };
        !given.contains(&variable.name) && values.iter().any(is_other)
    };
    if let Some((Variable { name, .. }, _)) = values.iter().find(differs) {
        let fact = format!("`{name}` has different values in the models that are joined");
        let help = format!("set it here, parameters = {{ {name} = ... }}, or rename it in one of them");
        return Err(join.diagnostic(fact).with_help(help));
    }
    let model = Joined::new(models).map_err(|mistake| join.locate(&mistake))?;
    Ok(ModelBuilder { model: Box::new(model), parameters })
}
