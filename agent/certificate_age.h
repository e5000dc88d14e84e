// CertificateAge: when an agent asks for the next certificate, and how much is left of the one it has.
//
//   const CertificateAge age{.issued_s = identity.certificate_time(), .life_s = options.certificate_life_s};
//   if (age.IsDue(UnixSeconds())) ...
//
// By this host's wall clock, which may be off or be set: then a certificate is asked for early or late, and nothing
// else comes of it, since no certificate stops counting by a date. One that was issued later than now, by a clock that
// has been set back, is due, and so is one that an agent of an earlier release got at a time that it did not keep (0).
//
// Thread rule: values.
#pragma once

#include <cstdint>

namespace tessera::agent {

struct CertificateAge {
  double issued_s = 0;  // Unix time
  double life_s = 0;

  bool IsDue(double now_s) const { return now_s < issued_s || now_s - issued_s >= life_s * 2 / 3; }
  // Below 0: it should long have been replaced.
  double Left(double now_s) const { return issued_s + life_s - (now_s < issued_s ? issued_s : now_s); }
};

}  // namespace tessera::agent
