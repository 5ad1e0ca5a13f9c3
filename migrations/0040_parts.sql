-- Meshes that are sent in parts, so that a connection that breaks costs one of them.

CREATE TABLE open_upload (
    id         TEXT   NOT NULL PRIMARY KEY,
    owner      TEXT   NOT NULL,
    name       TEXT   NOT NULL,
    created    BIGINT NOT NULL,
    -- When something was last done with it; some time after that it is forgotten.
    touched    BIGINT NOT NULL,
    -- Until when a coordinator that puts it together holds it.
    held_until BIGINT NOT NULL,
    -- The upload that it has become.
    upload     TEXT,
    -- Why it cannot become one.
    problem    TEXT
);

CREATE INDEX open_upload_by_owner ON open_upload (owner);

CREATE TABLE upload_part (
    upload TEXT   NOT NULL REFERENCES open_upload (id) ON DELETE CASCADE,
    number BIGINT NOT NULL,
    blob   TEXT   NOT NULL,
    bytes  BIGINT NOT NULL,
    -- SHA-256, for the client's sake.
    sha256 TEXT   NOT NULL,
    PRIMARY KEY (upload, number)
);

CREATE INDEX upload_part_by_blob ON upload_part (blob);

CREATE INDEX upload_by_owner ON upload (owner);
