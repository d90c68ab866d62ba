#include "points/mirror_evidence.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

void addImages(int count, int num_points, int num_below_ground, MirrorEvidence* evidence) {
  for (int image = 0; image < count; ++image) {
    for (int i = 0; i < num_points; ++i) {
      evidence->add(i < num_below_ground);
    }
    evidence->endImage();
  }
}

TEST(MirrorEvidenceTest, FewPointsBelowTheGroundAreMoversByChance) {
  MirrorEvidence evidence;
  EXPECT_FALSE(evidence.isMirror());
  addImages(50, 1000, 6, &evidence);
  EXPECT_FALSE(evidence.isMirror());
}

TEST(MirrorEvidenceTest, ManyPointsBelowTheGroundTellThatItMirrors) {
  MirrorEvidence evidence;
  addImages(1, 1000, 70, &evidence);
  EXPECT_TRUE(evidence.isMirror());
}

TEST(MirrorEvidenceTest, StandingKeepsWhatWasSeenAndDryGroundEndsIt) {
  MirrorEvidence evidence;
  addImages(1, 1000, 100, &evidence);
  addImages(1000, 0, 0, &evidence);
  EXPECT_TRUE(evidence.isMirror());
  addImages(30, 1000, 2, &evidence);
  EXPECT_FALSE(evidence.isMirror());
}

}  // namespace
}  // namespace vcharge
