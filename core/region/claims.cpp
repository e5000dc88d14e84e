#include "core/region/claims.h"

#include "absl/strings/str_cat.h"

namespace tessera::region {

absl::Status CheckClaims(const BorderFrame& frame, const Bodies& bodies, std::span<const DepartingBody> departing,
                         const GrantsIn& grants_in) {
  const auto owned_here = [&](BodyId id) { return bodies.Owns(id) && FindDeparting(departing, id) == nullptr; };
  for (const GhostRecord& ghost : frame.ghosts) {
    if (owned_here(ghost.id)) {
      return absl::PermissionDeniedError(absl::StrCat("body ", ghost.id.value(), " is owned here"));
    }
  }
  for (const Grant& grant : frame.grants) {
    for (const GrantedBody& body : grant.bodies) {
      if (grants_in.IsRepeat(frame.sender, body, bodies)) continue;
      if (owned_here(body.id)) {
        return absl::PermissionDeniedError(absl::StrCat("body ", body.id.value(), " is owned here and granted"));
      }
      const Ghost* ghost = bodies.FindGhost(body.id);
      if (ghost != nullptr && body.epoch <= ghost->record.epoch) {
        return absl::PermissionDeniedError(absl::StrCat("body ", body.id.value(), " is granted with epoch ",
                                                        body.epoch.value(), " after ", ghost->record.epoch.value()));
      }
    }
  }
  return absl::OkStatus();
}

}  // namespace tessera::region
