// Damping: velocity that decays by a given share a second, and its closed form.
//
//   dv/dt = a - k v:   v(t) = v e^(-k t) + a s(t),   p(t) = p + v s(t) + a (t - s(t)) / k,   s(t) = (1 - e^(-k t)) / k
//
// with k = -ln(1 - share). Without damping it is the parabola.
#pragma once

namespace tessera::physics {

class Damping {
 public:
  Damping() = default;
  explicit Damping(double share_a_second) : share_(share_a_second) {}

  bool none() const { return share_ <= 0; }
  // Computes the factors of a step, once for each length of step. It has exponentials of its own, which give the same
  // bits on every host.
  void Prepare(double dt_s);
  double kept() const { return kept_; }            // e^(-k dt)
  double slid_s() const { return slid_s_; }        // s(dt)
  double fallen_s2() const { return fallen_s2_; }  // (dt - s(dt)) / k

 private:
  double share_ = 0;
  double dt_s_ = 0, kept_ = 1, slid_s_ = 0, fallen_s2_ = 0;
};

}  // namespace tessera::physics
