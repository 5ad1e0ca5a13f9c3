-- Jobs that are done again in part, and results that are taken over from earlier jobs.

-- The stage of the task that added it; -1 for those of the submission. What a stage that is done again had added, it adds anew.
ALTER TABLE task ADD COLUMN origin BIGINT NOT NULL DEFAULT -1;

-- The stage of the task that made it.
ALTER TABLE artifact ADD COLUMN stage BIGINT NOT NULL DEFAULT 0;

-- What a task made of certain inputs: the key is a hash of all that its result depends on.
CREATE TABLE outcome (
    city TEXT   NOT NULL,
    key  TEXT   NOT NULL,
    -- The tasks that it added, as JSON.
    tasks TEXT  NOT NULL,
    -- When it was made or last taken over.
    used BIGINT NOT NULL,
    PRIMARY KEY (city, key)
);

CREATE INDEX outcome_by_use ON outcome (used);

CREATE TABLE outcome_artifact (
    city  TEXT   NOT NULL,
    key   TEXT   NOT NULL,
    path  TEXT   NOT NULL,
    blob  TEXT   NOT NULL,
    bytes BIGINT NOT NULL,
    PRIMARY KEY (city, key, path),
    FOREIGN KEY (city, key) REFERENCES outcome (city, key) ON DELETE CASCADE
);

CREATE INDEX outcome_artifact_by_blob ON outcome_artifact (blob);
