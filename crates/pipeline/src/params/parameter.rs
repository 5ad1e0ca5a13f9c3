//! The one list of parameters: those of the stages, and those that methods declare.

use super::registry::Registry;
use super::table::{GROUPS, declarations};
use super::{ParamError, Params, nearest};
use gable_parameters::{Bounds, Declaration, Wrong};
use std::sync::OnceLock;

/// The group of the labelling, whose methods declare parameters of their own.
pub(super) const LABELLING: &str = "segmentation";

/// The group of the reconstruction, whose methods declare parameters of their own.
pub(super) const RECONSTRUCTION: &str = "modeling";

/// One parameter of the list.
#[derive(Debug)]
pub struct Parameter {
    /// Full name, `group.name`.
    pub name: String,
    /// Group: the stage that it belongs to.
    pub group: &'static str,
    /// The methods that have it, empty if it is the stage's own.
    pub methods: Vec<&'static str>,
    /// `number`, `integer`, `switch`, `choice`, `list`, `text` or `file`.
    pub kind: &'static str,
    /// Unit, empty for bare numbers.
    pub unit: &'static str,
    /// Limits, for numbers.
    pub bounds: Option<Bounds>,
    /// What can be chosen, for switches, choices and lists.
    pub choices: Vec<&'static str>,
    /// One line of help.
    pub help: &'static str,
    /// Whether few users need it.
    pub is_expert: bool,
    /// The stage's declaration, or those of the methods in the order of `methods`.
    declarations: Vec<&'static Declaration>,
}

/// Every parameter, in the order of the work; the stage's own before those of its methods.
#[must_use]
pub fn parameters() -> &'static [Parameter] {
    static LIST: OnceLock<Vec<Parameter>> = OnceLock::new();
    LIST.get_or_init(list)
}

fn list() -> Vec<Parameter> {
    let mut all: Vec<Parameter> = Vec::new();
    for (group, _) in GROUPS {
        for declaration in declarations(group) {
            all.push(Parameter::new(group, declaration, None));
        }
        for (method, declared) in methods(group) {
            for declaration in declared {
                let name = full_name(group, declaration);
                match all.iter_mut().find(|parameter| parameter.name == name) {
                    Some(known) => {
                        assert!(!known.methods.is_empty(), "{name} is the stage's own: {method} needs another name");
                        known.methods.push(method);
                        known.declarations.push(declaration);
                    }
                    None => all.push(Parameter::new(group, declaration, Some(method))),
                }
            }
        }
    }
    all
}

/// The methods of a group's stage with what they declare.
fn methods(group: &str) -> Vec<(&'static str, &'static [Declaration])> {
    let registry = Registry::get();
    match group {
        LABELLING => registry.labellers().iter().map(|method| (method.name(), method.parameters())).collect(),
        RECONSTRUCTION => {
            registry.reconstructions().iter().map(|method| (method.name(), method.parameters())).collect()
        }
        _ => Vec::new(),
    }
}

fn full_name(group: &str, declaration: &Declaration) -> String {
    format!("{group}.{}", declaration.name)
}

impl Parameter {
    fn new(group: &'static str, declaration: &'static Declaration, method: Option<&'static str>) -> Self {
        let choices = match (method, declaration.name) {
            (None, "method") => methods(group).into_iter().map(|(name, _)| name).collect(),
            _ => declaration.choices.to_vec(),
        };
        Self {
            name: full_name(group, declaration),
            group,
            methods: method.into_iter().collect(),
            kind: if declaration.name == "method" { "choice" } else { declaration.kind },
            unit: declaration.unit,
            bounds: declaration.bounds,
            choices,
            help: declaration.help,
            is_expert: declaration.is_expert,
            declarations: vec![declaration],
        }
    }

    /// The last part of its name.
    #[must_use]
    pub fn short_name(&self) -> &'static str {
        self.declarations[0].name
    }

    /// Whether the chosen method of its stage has it, or the stage itself.
    #[must_use]
    pub fn applies(&self, params: &Params) -> bool {
        self.methods.is_empty() || self.methods.contains(&params.method_of(self.group))
    }

    /// The declaration that counts: that of the chosen method where it has one.
    fn declaration(&self, params: &Params) -> &'static Declaration {
        let chosen = params.method_of(self.group);
        let place = self.methods.iter().position(|method| *method == chosen).unwrap_or(0);
        self.declarations[place]
    }

    /// The default for each of `methods`; one alone if it is the stage's own.
    #[must_use]
    pub fn defaults(&self) -> Vec<String> {
        self.declarations.iter().map(|declaration| (declaration.default)()).collect()
    }

    /// The value in `params`, as text.
    #[must_use]
    pub fn value(&self, params: &Params) -> String {
        if self.methods.is_empty() {
            return params.stage_value(self.group, self.short_name()).unwrap_or_default();
        }
        let set = params.own.get(&self.name).filter(|_| self.applies(params));
        set.map_or_else(|| (self.declaration(params).default)(), |setting| setting.text.clone())
    }

    /// Reads a value for `params`, which holds the limits; the text is as it is written.
    pub(super) fn read(&self, params: &Params, text: &str) -> Result<String, ParamError> {
        let wrong = |expected: String| ParamError::Value { name: self.name.clone(), value: text.to_owned(), expected };
        if self.is_method() {
            let lower = text.trim().to_ascii_lowercase();
            let canonical = match self.group {
                LABELLING => Registry::get().labeller(&lower).map(|method| method.name()),
                _ => Registry::get().reconstruction(&lower).map(|method| method.name()),
            };
            return canonical.map(str::to_owned).ok_or_else(|| wrong(format!("one of {}", self.choices.join(", "))));
        }
        match self.declaration(params).read(text) {
            Ok(reading) => Ok(reading.text),
            Err(Wrong::Kind { expected }) => Err(wrong(expected)),
            Err(Wrong::Range { value, bounds: Bounds { min, max } }) => {
                Err(ParamError::Range { name: self.name.clone(), value, min, max, unit: self.unit.to_owned() })
            }
        }
    }

    /// Whether it chooses the method of a stage.
    fn is_method(&self) -> bool {
        self.methods.is_empty() && self.short_name() == "method"
    }

    /// The range as a user reads it: limits with the unit, or what can be chosen.
    #[must_use]
    pub fn range(&self) -> String {
        match self.bounds {
            Some(Bounds { min, max }) => format!("{min} to {max}"),
            None => self.choices.join(", "),
        }
    }
}

/// The parameters that a name stands for: its full name, or the last part of it where that is unique.
/// `method` alone stands for the method of every stage.
pub(super) fn resolve(name: &str) -> Result<Vec<&'static Parameter>, ParamError> {
    let name = name.trim().replace('-', "_");
    let all = parameters();
    let mut found: Vec<_> = all.iter().filter(|p| p.name == name).collect();
    if found.is_empty() {
        found = all.iter().filter(|p| p.short_name() == name).collect();
    }
    match found.len() {
        0 => {
            let suggestion = nearest(&name, all.iter().map(|p| p.name.as_str()));
            Err(ParamError::Unknown { name, suggestion })
        }
        1 => Ok(found),
        _ if name == "method" => Ok(found),
        _ => Err(ParamError::Ambiguous { name, candidates: found.iter().map(|p| p.name.clone()).collect() }),
    }
}
