// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
#include "island_tags.h"

#include "../gpu_engine/zone.h"

BTGPU_TRANSLATION_BEGIN

void writeIslandTags(const btCollisionObjectArray& objects, const WorldReader& reader, const StepResults& results) {
  const Zone zone("writeIslandTags");
  std::vector<int> numbers(results.roots.size(), -1);  // by slot
  int next = 0;
  for (int i = 0; i < objects.size(); ++i) {
    if (objects[i]->isStaticOrKinematicObject()) continue;
    const std::uint32_t slot = reader.slotOf(*objects[i]);
    if (slot != kNoSlot && slot < numbers.size()) numbers[slot] = next;
    ++next;
  }
  for (int i = 0; i < objects.size(); ++i) {
    const std::uint32_t slot = reader.slotOf(*objects[i]);
    if (slot == kNoSlot || slot >= numbers.size()) continue;
    const bool member = numbers[slot] >= 0;
    objects[i]->setIslandTag(member ? numbers[results.roots[slot]] : -1);
    objects[i]->setCompanionId(member ? -1 : -2);
  }
}

BTGPU_TRANSLATION_END
