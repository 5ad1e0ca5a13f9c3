-- Meshes that users have sent: files by path, whose contents are in the object store.

CREATE TABLE upload (
    id      TEXT   NOT NULL PRIMARY KEY,
    owner   TEXT   NOT NULL,
    name    TEXT   NOT NULL,
    bytes   BIGINT NOT NULL,
    files   BIGINT NOT NULL,
    created BIGINT NOT NULL,
    -- When a task last asked for it.
    used    BIGINT NOT NULL
);

CREATE TABLE upload_file (
    upload TEXT   NOT NULL REFERENCES upload (id) ON DELETE CASCADE,
    path   TEXT   NOT NULL,
    blob   TEXT   NOT NULL,
    bytes  BIGINT NOT NULL,
    PRIMARY KEY (upload, path)
);

CREATE INDEX upload_file_by_blob ON upload_file (blob);
