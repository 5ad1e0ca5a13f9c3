//! What a caller may see and do: cities have members, and jobs, uploads and results belong to cities.
//!
//! What a caller may not see is answered like what is not there. Operators may do everything.

use crate::audit::About;
use crate::shared::Freshness;
use crate::{Caller, Coordinator, Problem};
use axum::extract::{FromRequestParts, RawPathParams};
use axum::http::StatusCode;
use axum::http::request::Parts;
use gable_files::SourceRoots;
use gable_job_store::{Job, Role, Scope, Upload};

/// Prefix of the names of groups among members.
const GROUP: &str = "group:";

impl Caller {
    /// The names as which the caller may be a member: their own, and those of their groups.
    pub(crate) fn names(&self) -> Vec<String> {
        let groups = self.groups.iter().map(|group| format!("{GROUP}{group}"));
        std::iter::once(self.name.clone()).chain(groups).collect()
    }

    /// The names whose cities the caller sees; none for one who sees all.
    pub(crate) fn sees(&self) -> Option<Vec<String>> {
        (self.scope < Scope::Operator).then(|| self.names())
    }

    /// An error unless the caller may give a job this priority.
    pub(crate) fn may_have_priority(&self, priority: i64) -> Result<(), Problem> {
        if priority > 0 && self.scope < Scope::Operator {
            let detail = "priorities above 0, before the jobs of others, are for operators to give";
            return Err(Problem::forbidden(detail));
        }
        Ok(())
    }
}

impl Coordinator {
    /// The caller's role in a city; none for one who is no member.
    async fn role(&self, caller: &Caller, city: &str, freshness: Freshness) -> Result<Option<Role>, Problem> {
        if caller.scope == Scope::Operator {
            return Ok(Some(Role::Owner));
        }
        let names = caller.names();
        let key = format!("{}\n{city}", names.join("\n"));
        let role = self.answers.roles.get(&key, freshness, |_| self.store.role(city, &names)).await?;
        Ok(role)
    }

    /// An error unless the caller has at least this role in a city: as if it were not there, if they are no member.
    pub(crate) async fn needs_role(&self, caller: &Caller, city: &str, role: Role) -> Result<(), Problem> {
        let freshness = match role {
            // Looking may go on for a moment after a member was removed; doing may not.
            Role::Viewer => Freshness::lately(self.store.writes()),
            _ => Freshness::now(self.store.writes()),
        };
        match self.role(caller, city, freshness).await? {
            None => Err(no_city(city)),
            Some(found) if found < role => {
                let (needed, found) = (role.name(), found.name());
                Err(Problem::forbidden(format!("this needs a member of {city:?} who is {needed}, you are {found}")))
            }
            Some(_) => Ok(()),
        }
    }

    /// A job, if the caller sees it.
    pub(crate) async fn seen_job(&self, caller: &Caller, id: &str) -> Result<Job, Problem> {
        let job = self.store.job(id).await?;
        self.sees_city(caller, &job.city, || Problem::not_found(format!("there is no job {id}"))).await?;
        Ok(job)
    }

    /// An error, as if there were none, unless the caller sees a job. Who polls is answered from memory.
    async fn sees_job(&self, caller: &Caller, id: &str) -> Result<Option<String>, Problem> {
        if caller.scope == Scope::Operator {
            return Ok(None);
        }
        let freshness = Freshness::lately(self.store.writes());
        let city = self.answers.cities.get(id, freshness, async |_| self.store.job(id).await.map(|job| job.city));
        let city = city.await?;
        self.sees_city(caller, &city, || Problem::not_found(format!("there is no job {id}"))).await?;
        Ok(Some(city))
    }

    /// An error unless the caller sees a city.
    pub(crate) async fn sees_city(
        &self,
        caller: &Caller,
        city: &str,
        none: impl FnOnce() -> Problem,
    ) -> Result<(), Problem> {
        let role = self.role(caller, city, Freshness::lately(self.store.writes())).await?;
        role.map(drop).ok_or_else(none)
    }

    /// A job, if the caller may steer it: their own as an editor of its city, all of the city as its owner.
    pub(crate) async fn steered_job(&self, caller: &Caller, id: &str) -> Result<Job, Problem> {
        let job = self.seen_job(caller, id).await?;
        caller.needs(Scope::Submitter)?;
        let role = if job.owner == caller.name { Role::Editor } else { Role::Owner };
        self.needs_role(caller, &job.city, role).await?;
        Ok(job)
    }

    /// Whether the caller may use an upload as the source of a job: they have sent it, or are an editor of its city.
    pub(crate) async fn may_use(&self, caller: &Caller, upload: &Upload) -> Result<bool, Problem> {
        if upload.owner == caller.name || caller.scope == Scope::Operator {
            return Ok(true);
        }
        let Some(city) = &upload.city else { return Ok(false) };
        let role = self.role(caller, city, Freshness::now(self.store.writes())).await?;
        Ok(role >= Some(Role::Editor))
    }

    /// What may be sources of jobs of this caller.
    pub(crate) fn roots_of(&self, caller: &Caller) -> Result<SourceRoots, Problem> {
        let all = caller.scope == Scope::Operator;
        let mut places: Vec<_> = self.roots.places().collect();
        let mut own = self.roots.own().to_vec();
        for (group, roots) in &self.group_roots {
            if all || caller.groups.contains(group) {
                places.extend(roots.places());
            } else {
                // Also where they lie in a root that is for everybody.
                own.extend(roots.places());
            }
        }
        SourceRoots::new(places, own).map_err(|e| {
            tracing::error!("a source root is not there: {e}");
            Problem::source("a source root of the service is not there: its log tells more")
        })
    }
}

fn no_city(city: &str) -> Problem {
    Problem::not_found(format!("there is no city {city:?}"))
}

/// A caller who sees the job that the path names as `id`.
#[derive(Clone, Debug)]
pub(crate) struct OfJob(pub(crate) Caller);

impl FromRequestParts<Coordinator> for OfJob {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Coordinator) -> Result<Self, Problem> {
        let caller = Caller::from_request_parts(parts, service).await?;
        let id = named(parts, service, "id").await?;
        if let Some(city) = service.sees_job(&caller, &id).await? {
            About::note(parts, &city);
        }
        Ok(Self(caller))
    }
}

/// A caller who sees the city that the path names as `city`.
#[derive(Clone, Debug)]
pub(crate) struct OfCity(pub(crate) Caller);

impl FromRequestParts<Coordinator> for OfCity {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, service: &Coordinator) -> Result<Self, Problem> {
        let caller = Caller::from_request_parts(parts, service).await?;
        let city = named(parts, service, "city").await?;
        About::note(parts, &city);
        service.sees_city(&caller, &city, || no_city(&city)).await?;
        Ok(Self(caller))
    }
}

/// A part of the path.
async fn named(parts: &mut Parts, service: &Coordinator, name: &str) -> Result<String, Problem> {
    let path = RawPathParams::from_request_parts(parts, service).await;
    let path =
        path.map_err(|e| Problem::new(StatusCode::BAD_REQUEST, "path", "The path cannot be read", e.body_text()))?;
    let found = path.iter().find(|(known, _)| *known == name).map(|(_, value)| value.to_owned());
    found.ok_or_else(|| Problem::not_found("no such address: /docs lists all"))
}
