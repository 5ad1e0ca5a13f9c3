//! Arguments of `gable serve` about people who sign in.

use clap::Args;
use gable_coordinator::RoleOfGroup;

/// The provider at which people sign in, and what its groups may do.
#[derive(Args, Debug)]
#[command(next_help_heading = "People who sign in (OpenID Connect)")]
pub(crate) struct SignInArgs {
    /// Address of a provider of OpenID Connect, as it names itself: people sign in there at the dashboard, programs go on to show tokens. It
    /// sends browsers back to /auth/callback of this service
    #[arg(long, value_name = "URL", requires = "oidc_client", requires = "oidc_role", conflicts_with = "open")]
    pub(crate) oidc_issuer: Option<String>,
    /// Name under which the provider knows this service; its secret, if there is one, is in the variable GABLE_OIDC_SECRET
    #[arg(long, value_name = "ID", requires = "oidc_issuer")]
    pub(crate) oidc_client: Option<String>,
    /// What a group may do, such as operator=gable-admins, or viewer=* for all who can sign in; may be given many times, the most counts
    #[arg(long, value_name = "SCOPE=GROUP", requires = "oidc_issuer")]
    pub(crate) oidc_role: Vec<RoleOfGroup>,
    /// Claim with the name of somebody, which nobody else may have or choose; that of email has to be verified
    #[arg(long, value_name = "CLAIM", default_value = "email")]
    pub(crate) oidc_name: String,
    /// Claim with the groups of somebody; realm_access.roles is one within another
    #[arg(long, value_name = "CLAIM", default_value = "groups")]
    pub(crate) oidc_groups: String,
    /// What the provider is asked for besides openid; may be given many times
    #[arg(long, value_name = "SCOPE", default_values = ["profile", "email"])]
    pub(crate) oidc_scope: Vec<String>,
    /// How long somebody is signed in, hours: rights that are taken away at the provider end with that
    #[arg(long, value_name = "H", default_value_t = 12.0)]
    pub(crate) oidc_hours: f64,
}
