#include "light/mirror_evidence.h"

#include <gtest/gtest.h>

namespace vcharge {
namespace {

constexpr double kLeastPart = 0.03;

void addImages(int count, size_t seen, size_t reflections, MirrorEvidence* evidence) {
  for (int image = 0; image < count; ++image) {
    evidence->add(seen, reflections);
    evidence->endImage();
  }
}

TEST(MirrorEvidenceTest, FewReflectionsAreMoversByChance) {
  MirrorEvidence evidence(kLeastPart);
  EXPECT_FALSE(evidence.isMirror());
  addImages(50, 1000, 6, &evidence);
  EXPECT_FALSE(evidence.isMirror());
}

TEST(MirrorEvidenceTest, ManyReflectionsTellThatItMirrors) {
  MirrorEvidence evidence(kLeastPart);
  addImages(1, 1000, 70, &evidence);
  EXPECT_TRUE(evidence.isMirror());
}

TEST(MirrorEvidenceTest, StandingKeepsWhatWasSeenAndDryGroundEndsIt) {
  MirrorEvidence evidence(kLeastPart);
  addImages(1, 1000, 100, &evidence);
  addImages(1000, 0, 0, &evidence);
  EXPECT_TRUE(evidence.isMirror());
  addImages(30, 1000, 2, &evidence);
  EXPECT_FALSE(evidence.isMirror());
}

}  // namespace
}  // namespace vcharge
