#include "control_plane/store.h"

#include <set>

#include "absl/strings/str_cat.h"

namespace tessera::control {

absl::StatusOr<Revision> Store::Put(std::string_view key, std::string_view value, Revision expected) {
  const StoreOp op = PutOp(std::string(key), std::string(value), expected);
  return Txn({&op, 1});
}

absl::StatusOr<Revision> Store::Delete(std::string_view key, Revision expected) {
  const StoreOp op = DeleteOp(std::string(key), expected);
  return Txn({&op, 1});
}

absl::Status Store::CheckOps(std::span<const StoreOp> ops) {
  if (ops.empty()) return absl::InvalidArgumentError("store: a transaction needs at least one write");
  std::set<std::string_view> keys;
  for (const StoreOp& op : ops) {
    if (op.key.empty()) return absl::InvalidArgumentError("store: a key is empty");
    if (!keys.insert(op.key).second)
      return absl::InvalidArgumentError(absl::StrCat("store: ", op.key, " is named twice"));
    if (op.kind == StoreOp::Kind::kDelete && op.expected == kAbsent) {
      return absl::InvalidArgumentError(absl::StrCat("store: the delete of ", op.key, " expects no such key"));
    }
  }
  return absl::OkStatus();
}

absl::Status Store::Conflict(const StoreOp& op, Revision found) {
  const auto name = [](Revision revision) {
    return revision == kAbsent ? std::string("absent") : absl::StrCat(revision);
  };
  return absl::AbortedError(
      absl::StrCat("store: ", op.key, " is at revision ", name(found), ", expected ", name(op.expected)));
}

}  // namespace tessera::control
