-- Who may use the service. Of a token only its hash is kept: tokens are 256 random bits, so a plain hash is enough.

CREATE TABLE api_token (
    hash     TEXT   NOT NULL PRIMARY KEY,
    name     TEXT   NOT NULL UNIQUE,
    scope    TEXT   NOT NULL,
    -- Most jobs that its holder may have under way; NULL for no limit.
    max_jobs BIGINT,
    created  BIGINT NOT NULL,
    expires  BIGINT
);
