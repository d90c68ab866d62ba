#include "pose_graph/loop_gate.h"

#include <algorithm>
#include <cmath>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

/// A planar drive with noisy steps and loops.
class Drive {
 public:
  Drive(double sigma_m, double sigma_rad) : sigma_m_(sigma_m), sigma_rad_(sigma_rad) {
    graph_.planar = true;
    graph_.map_from_node[0] = RigidTransform();
  }

  void step(double forward_m, double turn_rad) {
    truth_.push_back(truth_.back() * RigidTransform::planar(forward_m, 0.0, turn_rad));
    const auto last = static_cast<int64_t>(truth_.size()) - 1;
    add(last - 1, last, RigidTransform());
    odometry_.push_back(graph_.edges.size() - 1);
    graph_.map_from_node[last] = truth_.back();
  }
  void loop(int64_t first, int64_t second, const RigidTransform& error = RigidTransform()) {
    add(first, second, error);
    loops_.push_back(graph_.edges.size() - 1);
  }

  /// Verdicts of the loops, in the order in which they were added.
  std::vector<LoopVerdict> verdicts() const {
    LoopGate gate(graph_, odometry_, loops_, 1.0);
    gate.decide();
    std::vector<LoopVerdict> verdicts(loops_.size());
    for (const GatedGroup& group : gate.groups()) {
      for (const size_t edge : group.loops) {
        verdicts[std::find(loops_.begin(), loops_.end(), edge) - loops_.begin()] = group.verdict;
      }
    }
    return verdicts;
  }

 private:
  void add(int64_t first, int64_t second, const RigidTransform& error) {
    const auto noise = [this](double sigma) {
      return std::normal_distribution<double>(0.0, sigma)(generator_);
    };
    PoseGraphEdge edge;
    edge.first = first;
    edge.second = second;
    edge.first_from_second = truth_[first].inverse() * truth_[second] * error *
                             RigidTransform::planar(noise(sigma_m_), noise(sigma_m_), noise(sigma_rad_));
    edge.information(0, 0) = edge.information(1, 1) = 1.0 / (sigma_m_ * sigma_m_);
    edge.information(5, 5) = 1.0 / (sigma_rad_ * sigma_rad_);
    graph_.edges.push_back(edge);
  }

  double sigma_m_, sigma_rad_;
  std::mt19937 generator_{1};
  std::vector<RigidTransform> truth_{RigidTransform()};
  PoseGraph graph_;
  std::vector<size_t> odometry_, loops_;
};

/// A ring of 200 steps and the beginning of a second lap.
Drive makeRing(double sigma_m, double sigma_rad) {
  Drive drive(sigma_m, sigma_rad);
  for (int i = 0; i < 210; ++i) {
    drive.step(1.0, 2.0 * M_PI / 200.0);
  }
  return drive;
}

TEST(LoopGateTest, AFalseGroupHasOneVoteAndIsContradicted) {
  Drive drive = makeRing(0.02, 0.002);
  drive.loop(5, 205);
  // Thirty loops that agree with each other: another place looks the same.
  for (int64_t i = 0; i < 30; ++i) {
    drive.loop(40 + i, 120 + i, RigidTransform::planar(-40.0, 10.0, 1.0));
  }
  const std::vector<LoopVerdict> verdicts = drive.verdicts();
  EXPECT_EQ(verdicts[0], LoopVerdict::kAccepted);
  for (size_t i = 1; i < verdicts.size(); ++i) {
    EXPECT_EQ(verdicts[i], LoopVerdict::kContradicted) << i;
  }
}

TEST(LoopGateTest, ALoopThatTheOdometryCannotPredictIsLeftUndecided) {
  Drive drive = makeRing(0.02, 0.06);  // 50 degrees after the ring
  drive.loop(5, 205);
  EXPECT_EQ(drive.verdicts()[0], LoopVerdict::kUndecided);
}

TEST(LoopGateTest, PlacesThatAgreeConfirmEachOther) {
  // There and back again: the way back meets every place of the way there.
  Drive drive(0.02, 0.02);
  for (int i = 0; i < 200; ++i) {
    drive.step(1.0, 0.0);
  }
  drive.step(0.0, M_PI);
  for (int i = 0; i < 200; ++i) {
    drive.step(1.0, 0.0);
  }
  drive.loop(20, 381);
  drive.loop(60, 341);
  drive.loop(20, 361, RigidTransform::planar(-20.0, 0.0, 0.0));
  drive.loop(90, 311);
  const std::vector<LoopVerdict> verdicts = drive.verdicts();
  EXPECT_EQ(verdicts[0], LoopVerdict::kAccepted);
  EXPECT_EQ(verdicts[1], LoopVerdict::kAccepted);
  EXPECT_EQ(verdicts[2], LoopVerdict::kContradicted);
  EXPECT_EQ(verdicts[3], LoopVerdict::kAccepted);
}

TEST(LoopGateTest, NeighboursThatJoinFalselyAreContradicted) {
  Drive drive = makeRing(0.02, 0.002);
  for (int64_t i = 0; i < 60; ++i) {
    drive.loop(3 * i, 3 * i + 12, RigidTransform::planar(-10.0, 0.0, 0.0));
  }
  for (const LoopVerdict verdict : drive.verdicts()) {
    EXPECT_EQ(verdict, LoopVerdict::kContradicted);
  }
}

}  // namespace
}  // namespace vcharge
