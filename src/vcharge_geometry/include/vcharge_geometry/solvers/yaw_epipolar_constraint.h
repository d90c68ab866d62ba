#pragma once

#include <cmath>

#include "vcharge_geometry/solvers/half_angle_roots.h"
#include "vcharge_geometry/solvers/pluecker_line.h"
#include "vcharge_geometry/solvers/polynomial.h"

namespace vcharge {

/// Generalized epipolar constraint of a match for a rotation by the yaw theta about z:
/// rotation(c, s) + along * u(c, s) + across * w(c, s) + up * z(c, s) = 0, c = cos(theta/2), s =
/// sin(theta/2),
/// with the translation in the basis (c, s, 0), (-s, c, 0), (0, 0, 1), which is rotated by half the yaw. In
/// this basis, u and w are linear in (c, s) instead of quadratic, so determinants have no factor c^2 + s^2 =
/// 1 (the (1+q^2) of Lee et al.) that must be divided out. Coefficients are those of forms in (c, s), highest
/// power of c first.
struct YawEpipolarConstraint {
  Polynomial<2> rotation;  ///< metres
  Polynomial<1> along;
  Polynomial<1> across;
  Polynomial<2> up;

  explicit YawEpipolarConstraint(const LineMatch& match) {
    const Eigen::Vector3d& q = match.previous.direction;
    const Eigen::Vector3d& m = match.previous.moment_m;
    const Eigen::Vector3d& p = match.current.direction;
    const Eigen::Vector3d& n = match.current.moment_m;
    const double still = q.z() * n.z() + m.z() * p.z();
    const double cosine = q.x() * n.x() + q.y() * n.y() + m.x() * p.x() + m.y() * p.y();
    const double sine = q.y() * n.x() - q.x() * n.y() + m.y() * p.x() - m.x() * p.y();
    rotation = {still + cosine, 2.0 * sine, still - cosine};
    along = {q.z() * p.y() - p.z() * q.y(), q.z() * p.x() + p.z() * q.x()};
    across = {p.z() * q.x() - q.z() * p.x(), p.z() * q.y() + q.z() * p.y()};
    const double up_cosine = q.y() * p.x() - q.x() * p.y();
    up = {up_cosine, -2.0 * (q.x() * p.x() + q.y() * p.y()), -up_cosine};
    moment_scale_m_ = m.lpNorm<1>() + n.lpNorm<1>();
  }

  /// True if zero motion satisfies the constraint for any match, as within one camera. Then sine = 0 is a
  /// trivial root of every solver's polynomial.
  bool holdsWithoutMotion() const { return std::abs(rotation[0]) <= 1e-13 * moment_scale_m_; }

 private:
  double moment_scale_m_;
};

/// Value of a form of degree 1 or 2 at (cosine, sine).
inline double valueAt(const Polynomial<1>& form, const HalfAngle& half) {
  return form[0] * half.cosine + form[1] * half.sine;
}
inline double valueAt(const Polynomial<2>& form, const HalfAngle& half) {
  return (form[0] * half.cosine + form[1] * half.sine) * half.cosine + form[2] * half.sine * half.sine;
}

/// Determinant first.a * second.b - second.a * first.b of forms.
template <size_t A, size_t B>
std::array<double, A + B - 1> determinant(const std::array<double, A>& first_a,
                                          const std::array<double, B>& first_b,
                                          const std::array<double, A>& second_a,
                                          const std::array<double, B>& second_b) {
  std::array<double, A + B - 1> value = multiply(first_a, second_b);
  const std::array<double, A + B - 1> other = multiply(second_a, first_b);
  for (size_t i = 0; i < value.size(); ++i) {
    value[i] -= other[i];
  }
  return value;
}

/// Rotation by a yaw given as half angle, and translation in the half-rotated basis.
struct YawMotion {
  HalfAngle half_yaw{1.0, 0.0};
  double along = 0.0;   ///< metres, in the direction (cos(yaw/2), sin(yaw/2), 0)
  double across = 0.0;  ///< metres, to the left of this direction
  double up = 0.0;      ///< metres
  /// False if the length of the translation is undetermined; the translation is then a unit vector.
  bool scale_observable = true;

  double yaw() const { return 2.0 * std::atan2(half_yaw.sine, half_yaw.cosine); }
  RigidTransform transform() const {
    return RigidTransform(Eigen::Quaterniond(half_yaw.cosine, 0.0, 0.0, half_yaw.sine),
                          Eigen::Vector3d(along * half_yaw.cosine - across * half_yaw.sine,
                                          along * half_yaw.sine + across * half_yaw.cosine, up));
  }
};

/// Sign of a translation known up to its length, for small rotations: +1 or -1, such that the matched points
/// lie in front of both cameras.
inline double directionSign(const LineMatch* matches, int num_matches, const RigidTransform& motion) {
  double vote = 0.0;
  for (int i = 0; i < num_matches; ++i) {
    const Eigen::Vector3d& previous = matches[i].previous.direction;
    const Eigen::Vector3d current = motion.rotation() * matches[i].current.direction;
    // From depth (previous x current) = t x current.
    vote += motion.translation().cross(current).dot(previous.cross(current));
  }
  return vote < 0.0 ? -1.0 : 1.0;
}

}  // namespace vcharge
