BEGIN TRANSACTION;
CREATE TABLE documents (
    kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL, PRIMARY KEY (kind, name)
);
INSERT INTO "documents" VALUES('scenes','bunny','The bunny','{"version":1,"camera":{"position":[0,0,4],"target":[0,0,0]},"environment":{"type":"constant","radiance":0.5},"materials":{"clay":{"type":"diffuse","albedo":0.6}},"shapes":[{"type":"mesh","asset":"sha256:697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713","material":"clay"}]}');
INSERT INTO "documents" VALUES('materials','grey','grey','{"type":"diffuse","albedo":[0.1,0.2,0.3]}');
CREATE TABLE uses (
    asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (asset, kind, name)
) WITHOUT ROWID;
INSERT INTO "uses" VALUES('sha256:697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713','scenes','bunny');
COMMIT;
PRAGMA user_version = 1;
