-- What is removed, by people and by age.

-- Whether what it made for later stages is gone: then it cannot be retried.
ALTER TABLE job ADD COLUMN emptied BIGINT NOT NULL DEFAULT 0;

CREATE INDEX job_by_end ON job (finished);

-- The last job that made the same again; NULL if none did.
ALTER TABLE generation ADD COLUMN confirmed TEXT;
