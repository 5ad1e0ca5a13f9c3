//! What is made of what a provider says of somebody: a name, groups, and what they may do.

use crate::names::is_name;
use gable_job_store::Scope;
use serde_json::{Map, Value};
use std::str::FromStr;

/// What stands before the names of people who have signed in: no token has such a name.
pub const PERSON: &str = "user:";

/// Claims, by name.
pub(crate) type Claims = Map<String, Value>;

/// Most groups of somebody that are looked at.
const MOST: usize = 500;

/// Longest name of a group, bytes, as for those of tokens.
const LONGEST: usize = 200;

/// Which claims say who somebody is, and which groups may do what.
#[derive(Clone, Debug)]
pub struct Grants {
    /// The claim with the name: one that nobody can choose for themselves, and no two have.
    pub name: String,
    /// The claim with the groups; parts of its path are joined by `.`.
    pub groups: String,
    /// What groups may do; the most counts.
    pub roles: Vec<RoleOfGroup>,
}

/// What the members of a group may do: `SCOPE=GROUP`, or `SCOPE=*` for all who can sign in.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RoleOfGroup {
    scope: Scope,
    /// As the provider names it; none for everybody.
    group: Option<String>,
}

impl FromStr for RoleOfGroup {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let wrong = || {
            let scopes: Vec<&str> = Scope::ALL.iter().map(|scope| scope.name()).collect();
            format!("give SCOPE=GROUP, or SCOPE=* for all who can sign in; a scope is one of {}", scopes.join(", "))
        };
        let (scope, group) = text.split_once('=').ok_or_else(wrong)?;
        let scope = scope.parse().map_err(|_| wrong())?;
        match group {
            "" => Err(wrong()),
            "*" => Ok(Self { scope, group: None }),
            group => Ok(Self { scope, group: Some(group.to_owned()) }),
        }
    }
}

/// Somebody, by what a provider says.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Person {
    pub(super) name: String,
    pub(super) scope: Scope,
    pub(super) groups: Vec<String>,
}

/// Why somebody whom the provider knows is not let in.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub(super) enum NotLetIn {
    /// Nobody can be named so.
    #[error("the claim {0:?} is missing, or no name that can be shown: name another by --oidc-name")]
    Name(String),
    /// Anybody can say that it is theirs.
    #[error(
        "the provider does not say that the address {0:?} is verified (email_verified): verify it, or name another claim by --oidc-name"
    )]
    NotVerified(String),
    /// No group of theirs is let in.
    #[error("{0} is in no group of --oidc-role; their groups: {1}")]
    NoRole(String, String),
}

impl Grants {
    /// Whether the claims have all that is asked for.
    pub(super) fn are_told_by(&self, claims: &Claims) -> bool {
        let asks_for_groups = self.roles.iter().any(|role| role.group.is_some());
        claims.contains_key(&self.name) && (!asks_for_groups || at(claims, &self.groups).is_some())
    }

    /// Who somebody is, and what they may do.
    pub(super) fn person(&self, claims: &Claims) -> Result<Person, NotLetIn> {
        let said = claims.get(&self.name).and_then(Value::as_str).unwrap_or_default();
        let name = format!("{PERSON}{said}");
        if said.is_empty() || said != said.trim() || !is_name(&name) {
            return Err(NotLetIn::Name(self.name.clone()));
        }
        if self.name == "email" && !is_true(claims.get("email_verified")) {
            return Err(NotLetIn::NotVerified(said.to_owned()));
        }
        let groups = groups(at(claims, &self.groups));
        let grants = |role: &&RoleOfGroup| role.group.as_ref().is_none_or(|group| groups.contains(group));
        let scope = self.roles.iter().filter(grants).map(|role| role.scope).max();
        let scope = scope.ok_or_else(|| NotLetIn::NoRole(name.clone(), groups.join(", ")))?;
        Ok(Person { name, scope, groups: groups.iter().filter_map(|group| plain(group)).collect() })
    }
}

/// A claim by its path.
fn at<'a>(claims: &'a Claims, path: &str) -> Option<&'a Value> {
    // Some providers have names with dots, and some have objects.
    if let Some(whole) = claims.get(path) {
        return Some(whole);
    }
    let (first, rest) = path.split_once('.')?;
    at(claims.get(first)?.as_object()?, rest)
}

/// The groups in a claim: a list, or one alone.
fn groups(claim: Option<&Value>) -> Vec<String> {
    match claim {
        Some(Value::Array(list)) => list.iter().filter_map(Value::as_str).take(MOST).map(str::to_owned).collect(),
        Some(Value::String(one)) => vec![one.clone()],
        _ => Vec::new(),
    }
}

/// A group as tokens have them, which members of cities and source roots may name; none if it cannot be one.
fn plain(group: &str) -> Option<String> {
    // Keycloak names groups by their paths.
    let group = group.strip_prefix('/').unwrap_or(group);
    let right =
        !group.is_empty() && group.len() <= LONGEST && group.chars().all(|c| c.is_alphanumeric() || "._-".contains(c));
    right.then(|| group.to_owned())
}

/// Some providers write it as a text.
fn is_true(claim: Option<&Value>) -> bool {
    claim.is_some_and(|claim| claim == &Value::Bool(true) || claim.as_str() == Some("true"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use serde_json::json;

    fn grants(name: &str, groups: &str, roles: &[&str]) -> Grants {
        let roles = roles.iter().map(|role| role.parse().unwrap()).collect();
        Grants { name: name.to_owned(), groups: groups.to_owned(), roles }
    }

    fn claims(value: Value) -> Claims {
        value.as_object().unwrap().clone()
    }

    #[test]
    fn the_most_that_a_group_may_counts() {
        let grants = grants("email", "groups", &["viewer=*", "operator=admins", "submitter=/city/planners"]);
        let of = |groups: Value| {
            let said = json!({ "email": "ann@city.example", "email_verified": true, "groups": groups });
            grants.person(&claims(said)).unwrap()
        };
        assert_eq!(
            of(json!([])),
            Person { name: "user:ann@city.example".to_owned(), scope: Scope::Viewer, groups: vec![] }
        );
        assert_eq!(of(json!(["/city/planners", "/south"])).scope, Scope::Submitter);
        assert_eq!(of(json!(["/city/planners", "/south", "a,b", 3])).groups, ["south"]);
        assert_eq!(of(json!(["x", "admins", "/city/planners"])).scope, Scope::Operator);
        assert_eq!((of(json!("admins")).scope, of(json!("admins ")).scope), (Scope::Operator, Scope::Viewer));
        assert_eq!(of(json!({ "admins": true })).scope, Scope::Viewer);
    }

    #[test]
    fn who_cannot_be_named_or_has_no_role_is_not_let_in() {
        let grants = grants("email", "realm_access.roles", &["submitter=planners"]);
        let of = |said: Value| grants.person(&claims(said));
        let realm = json!({ "roles": ["planners"] });
        let told = |email: Value, verified: Value| json!({ "email": email, "email_verified": verified, "realm_access": realm });
        assert!(of(told(json!("a@b"), json!(true))).is_ok() && of(told(json!("a@b"), json!("true"))).is_ok());
        assert!(matches!(of(told(json!("a@b"), json!(false))), Err(NotLetIn::NotVerified(_))));
        assert!(matches!(of(json!({ "email": "a@b", "realm_access": realm })), Err(NotLetIn::NotVerified(_))));
        for name in [json!(""), json!(" a"), json!("a\u{202e}b"), json!("a\nb"), json!(7), json!("x".repeat(300))] {
            assert!(matches!(of(told(name, json!(true))), Err(NotLetIn::Name(_))));
        }
        let other = json!({ "email": "a@b", "email_verified": true, "realm_access": { "roles": ["x"] } });
        assert!(matches!(of(other), Err(NotLetIn::NoRole(..))));
        for bad in ["planners", "king=planners", "viewer=", "=x"] {
            assert!(bad.parse::<RoleOfGroup>().is_err(), "{bad}");
        }
    }
}
