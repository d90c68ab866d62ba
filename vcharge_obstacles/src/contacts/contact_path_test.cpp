#include "contacts/contact_path.h"

#include <optional>
#include <random>

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kPeriod_s = 0.08;

/// The path of contacts with independent errors along x, as those of a camera that looks along x.
ContactPath pathOf(const Eigen::Vector2d& velocity_m_per_s, double sigma_m, int num_contacts, unsigned seed) {
  std::mt19937 random(seed);
  std::normal_distribution<double> noise(0.0, sigma_m);
  ContactPath path;
  for (int i = 0; i < num_contacts; ++i) {
    const Timestamp stamp = Timestamp::fromNanoseconds(1'000'000'000) + durationFromSeconds(kPeriod_s * i);
    path.add(stamp,
             Eigen::Vector2d(5.0 + noise(random), 0.1 * noise(random)) + kPeriod_s * i * velocity_m_per_s);
    path.forgetBefore(stamp);
  }
  return path;
}

TEST(ContactPathTest, SomebodyWhoWalksIsToldWithHisVelocity) {
  for (const Eigen::Vector2d& walk : {Eigen::Vector2d(-1.2, 0.0), Eigen::Vector2d(0.3, 1.0)}) {
    int found = 0;
    for (unsigned seed = 0; seed < 20; ++seed) {
      if (const std::optional<Eigen::Vector2d> velocity = pathOf(walk, 0.15, 15, seed).velocity()) {
        ++found;
        EXPECT_LT((*velocity - walk).norm(), 0.5);
      }
    }
    EXPECT_GE(found, 19);
  }
}

TEST(ContactPathTest, WhatStandsDoesNotWalkHoweverWronglyItIsSeen) {
  for (const double sigma_m : {0.0, 0.02, 0.2, 1.0}) {
    for (unsigned seed = 0; seed < 200; ++seed) {
      EXPECT_FALSE(pathOf({0.0, 0.0}, sigma_m, 40, seed).velocity()) << sigma_m;
    }
  }
}

TEST(ContactPathTest, FewContactsAndShortWaysTellNothing) {
  EXPECT_FALSE(ContactPath().velocity());
  EXPECT_FALSE(pathOf({1.0, 0.0}, 0.0, 6, 0).velocity());
  EXPECT_FALSE(pathOf({0.2, 0.0}, 0.0, 40, 0).velocity());
  EXPECT_TRUE(pathOf({1.0, 0.0}, 0.0, 10, 0).velocity());
}

}  // namespace
}  // namespace vcharge
