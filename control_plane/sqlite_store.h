// SqliteStore: the embedded Store, one SQLite file.
//
// Write-ahead log and synchronous = FULL: a transaction that returned OK is on the disk. The file is locked while it is
// open, so a second control plane on the same folder is refused instead of sharing it.
#pragma once

#include <memory>
#include <mutex>

#include "control_plane/store.h"

struct sqlite3;
struct sqlite3_stmt;

namespace tessera::control {

class SqliteStore final : public Store {
 public:
  // Makes the file if there is none. Errors name `path`: kUnavailable (cannot be opened; in use by another process),
  // kFailedPrecondition (not a store, or of a newer version).
  static absl::StatusOr<std::unique_ptr<SqliteStore>> Open(const std::string& path);
  ~SqliteStore() override;
  SqliteStore(const SqliteStore&) = delete;
  SqliteStore& operator=(const SqliteStore&) = delete;

  absl::StatusOr<StoreEntry> Get(std::string_view key) const override;
  absl::StatusOr<std::vector<StoreEntry>> ListWithout(std::string_view prefix, std::string_view without) const override;
  absl::StatusOr<Revision> Txn(std::span<const StoreOp> ops) override;
  Revision revision() const override;

 private:
  struct Finalize {
    void operator()(sqlite3_stmt* statement) const;
  };
  struct Close {
    void operator()(sqlite3* database) const;
  };
  using Statement = std::unique_ptr<sqlite3_stmt, Finalize>;

  explicit SqliteStore(std::string path) : path_(std::move(path)) {}
  absl::Status Prepare();
  absl::Status Execute(const char* sql);
  absl::Status PrepareStatement(const char* sql, Statement& statement);
  absl::Status Error() const;
  absl::StatusOr<Revision> RevisionOf(const std::string& key);
  absl::Status Apply(std::span<const StoreOp> ops, Revision revision);

  std::string path_;
  mutable std::mutex mutex_;
  std::unique_ptr<sqlite3, Close> database_;
  // Declared after what they belong to, so finalised first.
  Statement get_, list_, revision_of_, put_, delete_, set_revision_;
  Revision revision_ = 0;
};

}  // namespace tessera::control
