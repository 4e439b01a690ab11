BEGIN TRANSACTION;
CREATE TABLE documents (
                kind TEXT NOT NULL, name TEXT NOT NULL, title TEXT NOT NULL, body TEXT NOT NULL,
                PRIMARY KEY (kind, name)
            );
INSERT INTO "documents" VALUES('scenes','bunny','The bunny','{"version":1,"camera":{"position":[0,0,4],"target":[0,0,0]},"environment":{"type":"constant","radiance":0.5},"materials":{"clay":{"type":"diffuse","albedo":0.6}},"shapes":[{"type":"mesh","asset":"sha256:697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713","material":"clay"}]}');
INSERT INTO "documents" VALUES('materials','grey','grey','{"type":"diffuse","albedo":[0.1,0.2,0.3]}');
CREATE TABLE render_documents (number INTEGER PRIMARY KEY, body BLOB NOT NULL);
CREATE TABLE render_keys (
                owner TEXT NOT NULL, key TEXT NOT NULL, digest TEXT NOT NULL, number INTEGER NOT NULL,
                taken_at REAL NOT NULL, PRIMARY KEY (owner, key)
            ) WITHOUT ROWID;
CREATE TABLE render_uses (
                asset TEXT NOT NULL, number INTEGER NOT NULL, PRIMARY KEY (number, asset)
            ) WITHOUT ROWID;
CREATE TABLE renders (
                number INTEGER PRIMARY KEY AUTOINCREMENT, id TEXT NOT NULL UNIQUE, owner TEXT NOT NULL, label TEXT,
                priority INTEGER NOT NULL, created_at REAL NOT NULL, settings TEXT NOT NULL, bytes INTEGER NOT NULL,
                state TEXT NOT NULL, ended_at REAL, outcome TEXT NOT NULL, gone INTEGER NOT NULL DEFAULT 0
            );
CREATE TABLE uses (
                asset TEXT NOT NULL, kind TEXT NOT NULL, name TEXT NOT NULL, PRIMARY KEY (asset, kind, name)
            ) WITHOUT ROWID;
INSERT INTO "uses" VALUES('sha256:697b00ab13410c52a542d2e9c63711fcc04e9cbf6c0d3439a9b43cc812e6e713','scenes','bunny');
DELETE FROM "sqlite_sequence";
COMMIT;
PRAGMA user_version = 2;
