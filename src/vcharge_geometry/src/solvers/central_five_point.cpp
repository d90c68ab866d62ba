#include "solvers/central_five_point.h"

#include <opengv/relative_pose/CentralRelativeAdapter.hpp>
#include <opengv/relative_pose/methods.hpp>

#include <Eigen/SVD>

namespace vcharge {

void solveCentralFivePoint(const std::array<LineMatch, 5>& matches, CentralMotions* motions) {
  opengv::bearingVectors_t previous, current;
  for (const LineMatch& match : matches) {
    previous.push_back(match.previous.direction);
    current.push_back(match.current.direction);
  }
  const opengv::relative_pose::CentralRelativeAdapter adapter(previous, current);
  for (const Eigen::Matrix3d& essential : opengv::relative_pose::fivept_nister(adapter)) {
    if (!essential.allFinite() || essential.isZero() || motions->size() + 4 > 40) {
      continue;
    }
    const Eigen::JacobiSVD<Eigen::Matrix3d> svd(essential, Eigen::ComputeFullU | Eigen::ComputeFullV);
    Eigen::Matrix3d u = svd.matrixU(), v = svd.matrixV();
    u *= u.determinant() < 0.0 ? -1.0 : 1.0;
    v *= v.determinant() < 0.0 ? -1.0 : 1.0;
    Eigen::Matrix3d quarter_turn;
    quarter_turn << 0.0, -1.0, 0.0, 1.0, 0.0, 0.0, 0.0, 0.0, 1.0;
    for (const Eigen::Matrix3d& turn : {quarter_turn, Eigen::Matrix3d(quarter_turn.transpose())}) {
      const Eigen::Quaterniond rotation(Eigen::Matrix3d(u * turn * v.transpose()));
      motions->push_back({RigidTransform(rotation, u.col(2))});
      motions->push_back({RigidTransform(rotation, -u.col(2))});
    }
  }
}

}  // namespace vcharge
