-- Who may see and steer a city, and who did what.

-- Cities that someone has taken: the first who submits a job for one. What of it is published stands in `city`.
CREATE TABLE city_access (
    city    TEXT   NOT NULL PRIMARY KEY,
    claimed BIGINT NOT NULL
);

CREATE TABLE city_member (
    city   TEXT NOT NULL REFERENCES city_access (city) ON DELETE CASCADE,
    -- Name of a token, or group:NAME for all tokens of a group.
    member TEXT NOT NULL,
    -- viewer, editor or owner.
    role   TEXT NOT NULL,
    PRIMARY KEY (city, member)
);

CREATE INDEX city_member_by_member ON city_member (member, city);

-- Until now everybody saw everything: whoever has submitted jobs for a city goes on to, and the first of them owns it.
INSERT INTO city_access (city, claimed) SELECT city, MIN(created) FROM job GROUP BY city;
INSERT INTO city_member (city, member, role) SELECT DISTINCT city, owner, 'editor' FROM job;
UPDATE city_member SET role = 'owner' WHERE member =
    (SELECT owner FROM job WHERE job.city = city_member.city ORDER BY created, id LIMIT 1);

-- The city whose members may use it; NULL for its sender only.
ALTER TABLE upload ADD COLUMN city TEXT;
ALTER TABLE open_upload ADD COLUMN city TEXT;

-- Groups of the holder, each with a comma behind it.
ALTER TABLE api_token ADD COLUMN in_groups TEXT NOT NULL DEFAULT '';
-- The token before it was rotated, and until when that opens as well.
ALTER TABLE api_token ADD COLUMN old_hash TEXT;
ALTER TABLE api_token ADD COLUMN old_until BIGINT;

CREATE INDEX api_token_by_old_hash ON api_token (old_hash);

-- The earlier generation whose content it has anew; NULL for one that a job made.
ALTER TABLE generation ADD COLUMN restored BIGINT;

-- What was done through the service, by whom. Rows are only added, and purged by age.
CREATE TABLE audit (
    -- Ids of later rows sort later.
    id      TEXT   NOT NULL PRIMARY KEY,
    at      BIGINT NOT NULL,
    who     TEXT   NOT NULL,
    -- From where, as far as it is known.
    address TEXT,
    -- Method and kind of address, such as `POST /api/v1/jobs/{id}/cancel`.
    action  TEXT   NOT NULL,
    -- The address itself.
    target  TEXT   NOT NULL,
    -- HTTP status of the answer.
    status  BIGINT NOT NULL,
    city    TEXT,
    -- What was made, if something was.
    made    TEXT,
    -- How often, within a few seconds.
    times   BIGINT NOT NULL
);

CREATE INDEX audit_by_city ON audit (city, id);
CREATE INDEX audit_by_who ON audit (who, id);
CREATE INDEX audit_by_time ON audit (at);
