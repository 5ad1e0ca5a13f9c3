-- Cities and their generations. A row that is valid for several generations stands once: from generation `since` up to, but
-- without, `until` (NULL for still valid). So a generation costs what changed, and the difference of any two can be told.

CREATE TABLE city (
    name       TEXT   NOT NULL PRIMARY KEY,
    -- The generation that readers see; NULL before the first.
    generation BIGINT,
    created    BIGINT NOT NULL
);

CREATE TABLE generation (
    city      TEXT   NOT NULL REFERENCES city (name) ON DELETE CASCADE,
    number    BIGINT NOT NULL,
    -- The job that made it; jobs may be forgotten earlier.
    job       TEXT   NOT NULL,
    -- Whether blocks are missing.
    partial   BIGINT NOT NULL,
    crs       TEXT   NOT NULL,
    made      BIGINT NOT NULL,
    buildings BIGINT NOT NULL,
    -- Against the generation before.
    added     BIGINT NOT NULL,
    removed   BIGINT NOT NULL,
    changed   BIGINT NOT NULL,
    PRIMARY KEY (city, number)
);

CREATE TABLE building (
    city       TEXT   NOT NULL REFERENCES city (name) ON DELETE CASCADE,
    id         TEXT   NOT NULL,
    since      BIGINT NOT NULL,
    until      BIGINT,
    -- Of geometries and attributes.
    hash       TEXT   NOT NULL,
    tile       TEXT   NOT NULL,
    -- World coordinates, metres.
    west       DOUBLE PRECISION NOT NULL,
    south      DOUBLE PRECISION NOT NULL,
    east       DOUBLE PRECISION NOT NULL,
    north      DOUBLE PRECISION NOT NULL,
    lod        TEXT   NOT NULL,
    roof_type  TEXT,
    height     DOUBLE PRECISION NOT NULL,
    area       DOUBLE PRECISION NOT NULL,
    -- JSON.
    attributes TEXT   NOT NULL,
    PRIMARY KEY (city, id, since)
);

CREATE INDEX building_by_place ON building (city, west, south);

CREATE TABLE city_file (
    city  TEXT   NOT NULL REFERENCES city (name) ON DELETE CASCADE,
    path  TEXT   NOT NULL,
    since BIGINT NOT NULL,
    until BIGINT,
    blob  TEXT   NOT NULL,
    bytes BIGINT NOT NULL,
    PRIMARY KEY (city, path, since)
);

CREATE INDEX city_file_by_blob ON city_file (blob);
