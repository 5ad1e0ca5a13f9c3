//! What browsers may do with what they are given.
//!
//! Every answer says that it is what its type says, stands in no frame of another page, gives no address on to others, and loads nothing.
//! Pages that need more say so themselves, and what jobs made is shown apart from the service.

use axum::http::{HeaderName, HeaderValue, header};
use axum::response::Response;

/// For answers that are no pages: they load nothing and run nothing, should a browser show them as one.
const NOTHING: &str = "default-src 'none'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// For the dashboard: scripts, styles and data of this service only; pictures and the parts of models also from memory.
pub(crate) const DASHBOARD: &str = "default-src 'self'; img-src 'self' blob: data:; connect-src 'self' blob: data:; object-src 'none'; \
                                    base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// For the description of the API, whose program sets styles itself.
pub(crate) const DOCS: &str = "default-src 'self'; style-src 'self' 'unsafe-inline'; img-src 'self' data:; object-src 'none'; \
                               base-uri 'none'; form-action 'self'; frame-ancestors 'none'";

/// For the plain page: one style, in the page itself.
pub(crate) const PLAIN: &str =
    "default-src 'none'; style-src 'unsafe-inline'; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// For what a job made. A mesh, and all that is made of it, comes from somebody who may mean harm: a page of it has an origin of its own
/// (`sandbox` without `allow-same-origin`), so that its scripts reach neither the token that the dashboard keeps nor the API, and it
/// loads nothing.
pub(crate) const RESULT: &str = "sandbox allow-scripts; default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; \
                                 img-src data:; base-uri 'none'; form-action 'none'; frame-ancestors 'none'";

/// What an answer says unless it says otherwise.
const USUAL: [(HeaderName, &str); 6] = [
    (header::CONTENT_SECURITY_POLICY, NOTHING),
    (header::X_CONTENT_TYPE_OPTIONS, "nosniff"),
    (header::X_FRAME_OPTIONS, "DENY"),
    (header::REFERRER_POLICY, "no-referrer"),
    (HeaderName::from_static("cross-origin-opener-policy"), "same-origin"),
    (HeaderName::from_static("cross-origin-resource-policy"), "same-origin"),
];

/// Adds to an answer what it does not say itself.
pub(crate) async fn guard(mut response: Response) -> Response {
    for (name, value) in USUAL {
        response.headers_mut().entry(name).or_insert(HeaderValue::from_static(value));
    }
    response
}
