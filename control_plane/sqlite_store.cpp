#include "control_plane/sqlite_store.h"

#include <sqlite3.h>

#include "absl/strings/str_cat.h"

namespace tessera::control {
namespace {

constexpr int kSchemaVersion = 1;
constexpr char kSchema[] =
    "CREATE TABLE entries (key BLOB PRIMARY KEY, value BLOB NOT NULL, revision INTEGER NOT NULL);"
    "CREATE TABLE head (id INTEGER PRIMARY KEY CHECK (id = 1), revision INTEGER NOT NULL);"
    "INSERT INTO head VALUES (1, 0);"
    "PRAGMA user_version = 1;";

// Resets a statement when its use ends, so that it holds no lock and no pointer into its arguments.
class StatementUse {
 public:
  explicit StatementUse(sqlite3_stmt* statement) : statement_(statement) {}
  ~StatementUse() {
    sqlite3_reset(statement_);
    sqlite3_clear_bindings(statement_);
  }
  StatementUse(const StatementUse&) = delete;
  StatementUse& operator=(const StatementUse&) = delete;

  StatementUse& Blob(int index, std::string_view bytes) {
    // A null pointer would bind NULL, which an empty value is not.
    sqlite3_bind_blob64(statement_, index, bytes.empty() ? "" : bytes.data(), bytes.size(), SQLITE_STATIC);
    return *this;
  }
  StatementUse& Integer(int index, std::int64_t value) {
    sqlite3_bind_int64(statement_, index, value);
    return *this;
  }
  int Step() { return sqlite3_step(statement_); }
  std::string Bytes(int column) const {
    const void* data = sqlite3_column_blob(statement_, column);
    const auto size = static_cast<std::size_t>(sqlite3_column_bytes(statement_, column));
    return size == 0 ? std::string() : std::string(static_cast<const char*>(data), size);
  }
  std::int64_t Integer(int column) const { return sqlite3_column_int64(statement_, column); }

 private:
  sqlite3_stmt* statement_;
};

}  // namespace

void SqliteStore::Finalize::operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
void SqliteStore::Close::operator()(sqlite3* database) const { sqlite3_close(database); }

SqliteStore::~SqliteStore() = default;

absl::StatusOr<std::unique_ptr<SqliteStore>> SqliteStore::Open(const std::string& path) {
  std::unique_ptr<SqliteStore> store(new SqliteStore(path));
  sqlite3* database = nullptr;
  const int opened = sqlite3_open_v2(path.c_str(), &database,
                                     SQLITE_OPEN_READWRITE | SQLITE_OPEN_CREATE | SQLITE_OPEN_NOMUTEX, nullptr);
  store->database_.reset(database);
  if (opened != SQLITE_OK) return store->Error();
  if (absl::Status status = store->Prepare(); !status.ok()) return status;
  return store;
}

absl::Status SqliteStore::Prepare() {
  // Exclusive first: it makes the lock of the first transaction last for as long as the file is open.
  for (const char* sql : {"PRAGMA locking_mode = EXCLUSIVE", "PRAGMA journal_mode = WAL", "PRAGMA synchronous = FULL",
                          "BEGIN IMMEDIATE"}) {
    if (absl::Status status = Execute(sql); !status.ok()) return status;
  }
  Statement version;
  if (absl::Status status = PrepareStatement("PRAGMA user_version", version); !status.ok()) return status;
  std::int64_t found = 0;
  {
    StatementUse use(version.get());
    if (use.Step() != SQLITE_ROW) return Error();
    found = use.Integer(0);
  }
  if (found > kSchemaVersion) {
    return absl::FailedPreconditionError(absl::StrCat("store ", path_, ": has version ", found, ", this program knows ",
                                                      kSchemaVersion,
                                                      ": start the newer tessera-control that wrote it"));
  }
  if (found == 0) {
    if (absl::Status status = Execute(kSchema); !status.ok()) return status;
  }
  if (absl::Status status = Execute("COMMIT"); !status.ok()) return status;

  const std::pair<const char*, Statement*> statements[] = {
      {"SELECT key, value, revision FROM entries WHERE key = ?1", &get_},
      {"SELECT key, value, revision FROM entries WHERE substr(key, 1, ?2) = ?1 AND key >= ?1"
       " AND (?4 = 0 OR substr(key, 1, ?4) <> ?3) ORDER BY key",
       &list_},
      {"SELECT revision FROM entries WHERE key = ?1", &revision_of_},
      {"INSERT INTO entries VALUES (?1, ?2, ?3) ON CONFLICT (key) DO UPDATE SET value = ?2, revision = ?3", &put_},
      {"DELETE FROM entries WHERE key = ?1", &delete_},
      {"UPDATE head SET revision = ?1", &set_revision_}};
  for (const auto& [sql, statement] : statements) {
    if (absl::Status status = PrepareStatement(sql, *statement); !status.ok()) return status;
  }
  Statement head;
  if (absl::Status status = PrepareStatement("SELECT revision FROM head", head); !status.ok()) return status;
  StatementUse use(head.get());
  if (use.Step() != SQLITE_ROW) return Error();
  revision_ = use.Integer(0);
  return absl::OkStatus();
}

absl::StatusOr<StoreEntry> SqliteStore::Get(std::string_view key) const {
  const std::lock_guard lock(mutex_);
  StatementUse use(get_.get());
  const int result = use.Blob(1, key).Step();
  if (result == SQLITE_DONE) return absl::NotFoundError(absl::StrCat("store: no key ", std::string(key)));
  if (result != SQLITE_ROW) return Error();
  return StoreEntry{use.Bytes(0), use.Bytes(1), use.Integer(2)};
}

absl::StatusOr<std::vector<StoreEntry>> SqliteStore::ListWithout(std::string_view prefix,
                                                                 std::string_view without) const {
  const std::lock_guard lock(mutex_);
  StatementUse use(list_.get());
  use.Blob(1, prefix).Integer(2, static_cast<std::int64_t>(prefix.size()));
  use.Blob(3, without).Integer(4, static_cast<std::int64_t>(without.size()));
  std::vector<StoreEntry> entries;
  int result = SQLITE_ROW;
  while ((result = use.Step()) == SQLITE_ROW) entries.push_back({use.Bytes(0), use.Bytes(1), use.Integer(2)});
  if (result != SQLITE_DONE) return Error();
  return entries;
}

absl::StatusOr<Revision> SqliteStore::Txn(std::span<const StoreOp> ops) {
  if (absl::Status status = CheckOps(ops); !status.ok()) return status;
  const std::lock_guard lock(mutex_);
  if (absl::Status status = Execute("BEGIN IMMEDIATE"); !status.ok()) return status;
  const Revision revision = revision_ + 1;
  absl::Status status = Apply(ops, revision);
  if (status.ok()) status = Execute("COMMIT");
  if (!status.ok()) {
    // After some failures SQLite has rolled back by itself, and then this one is refused, harmlessly.
    sqlite3_exec(database_.get(), "ROLLBACK", nullptr, nullptr, nullptr);
    return status;
  }
  revision_ = revision;
  return revision;
}

absl::Status SqliteStore::Apply(std::span<const StoreOp> ops, Revision revision) {
  for (const StoreOp& op : ops) {
    const absl::StatusOr<Revision> at = RevisionOf(op.key);
    if (!at.ok()) return at.status();
    if (*at != op.expected) return Conflict(op, *at);
    const bool put = op.kind == StoreOp::Kind::kPut;
    StatementUse use(put ? put_.get() : delete_.get());
    use.Blob(1, op.key);
    if (put) use.Blob(2, op.value).Integer(3, revision);
    if (use.Step() != SQLITE_DONE) return Error();
  }
  StatementUse use(set_revision_.get());
  return use.Integer(1, revision).Step() == SQLITE_DONE ? absl::OkStatus() : Error();
}

absl::StatusOr<Revision> SqliteStore::RevisionOf(const std::string& key) {
  StatementUse use(revision_of_.get());
  const int result = use.Blob(1, key).Step();
  if (result == SQLITE_DONE) return kAbsent;
  if (result != SQLITE_ROW) return Error();
  return use.Integer(0);
}

Revision SqliteStore::revision() const {
  const std::lock_guard lock(mutex_);
  return revision_;
}

absl::Status SqliteStore::Execute(const char* sql) {
  return sqlite3_exec(database_.get(), sql, nullptr, nullptr, nullptr) == SQLITE_OK ? absl::OkStatus() : Error();
}

absl::Status SqliteStore::PrepareStatement(const char* sql, Statement& statement) {
  sqlite3_stmt* raw = nullptr;
  if (sqlite3_prepare_v2(database_.get(), sql, -1, &raw, nullptr) != SQLITE_OK) return Error();
  statement.reset(raw);
  return absl::OkStatus();
}

absl::Status SqliteStore::Error() const {
  switch (database_ ? sqlite3_errcode(database_.get()) : SQLITE_NOMEM) {
    case SQLITE_BUSY:
    case SQLITE_LOCKED:
      return absl::UnavailableError(absl::StrCat("store ", path_, ": is in use by another process"));
    case SQLITE_NOTADB:
    case SQLITE_CORRUPT:
      return absl::FailedPreconditionError(absl::StrCat("store ", path_, ": is not a store, or damaged"));
    default:
      return absl::UnavailableError(
          absl::StrCat("store ", path_, ": ", database_ ? sqlite3_errmsg(database_.get()) : "out of memory"));
  }
}

}  // namespace tessera::control
