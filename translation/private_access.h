// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Read access to the private members of btRigidBody that have no getter. The language lets an explicit template
// instantiation name a private member; nothing is changed through it, and a renamed member does not compile.
#pragma once

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

template <typename Tag, typename Tag::Type Member>
struct ExposeMember {
  friend typename Tag::Type memberPointer(Tag) { return Member; }
};

#define BTGPU_EXPOSE(Name, MemberType, Member) \
  struct Name {                                \
    using Type = MemberType btRigidBody::*;    \
    friend Type memberPointer(Name);           \
  };                                           \
  template struct ExposeMember<Name, &btRigidBody::Member>;

BTGPU_EXPOSE(AdditionalDamping, bool, m_additionalDamping)
BTGPU_EXPOSE(AdditionalDampingFactor, btScalar, m_additionalDampingFactor)
BTGPU_EXPOSE(AdditionalLinearThresholdSqr, btScalar, m_additionalLinearDampingThresholdSqr)
BTGPU_EXPOSE(AdditionalAngularThresholdSqr, btScalar, m_additionalAngularDampingThresholdSqr)

#undef BTGPU_EXPOSE

BTGPU_TRANSLATION_END
