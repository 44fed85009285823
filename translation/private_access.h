// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Access to private members of Bullet's classes that have no getter. The language lets an explicit template
// instantiation name a private member, and a renamed member does not compile. Those of the application's
// btRigidBody are only read.
#pragma once

#include <BulletCollision/CollisionDispatch/btBoxBoxCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConcaveCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexConvexAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btConvexPlaneCollisionAlgorithm.h>
#include <BulletCollision/CollisionDispatch/btSphereSphereCollisionAlgorithm.h>

#include "bullet.h"

BTGPU_TRANSLATION_BEGIN

template <typename Tag, typename Tag::Type Member>
struct ExposeMember {
  friend typename Tag::Type memberPointer(Tag) { return Member; }
};

#define BTGPU_EXPOSE(Name, Class, MemberType, Member) \
  struct Name {                                       \
    using Type = MemberType Class::*;                 \
    friend Type memberPointer(Name);                  \
  };                                                  \
  template struct ExposeMember<Name, &Class::Member>;

BTGPU_EXPOSE(AdditionalDamping, btRigidBody, bool, m_additionalDamping)
BTGPU_EXPOSE(AdditionalDampingFactor, btRigidBody, btScalar, m_additionalDampingFactor)
BTGPU_EXPOSE(AdditionalLinearThresholdSqr, btRigidBody, btScalar, m_additionalLinearDampingThresholdSqr)
BTGPU_EXPOSE(AdditionalAngularThresholdSqr, btRigidBody, btScalar, m_additionalAngularDampingThresholdSqr)
BTGPU_EXPOSE(ConstraintRefs, btRigidBody, btAlignedObjectArray<btTypedConstraint*>, m_constraintRefs)

// To ask for it ahead.
BTGPU_EXPOSE(ActivationState, btCollisionObject, int, m_activationState1)

// The manifold of an algorithm, and whether the algorithm releases it.
BTGPU_EXPOSE(BoxBoxManifold, btBoxBoxCollisionAlgorithm, btPersistentManifold*, m_manifoldPtr)
BTGPU_EXPOSE(BoxBoxOwns, btBoxBoxCollisionAlgorithm, bool, m_ownManifold)
BTGPU_EXPOSE(SphereSphereManifold, btSphereSphereCollisionAlgorithm, btPersistentManifold*, m_manifoldPtr)
BTGPU_EXPOSE(SphereSphereOwns, btSphereSphereCollisionAlgorithm, bool, m_ownManifold)
BTGPU_EXPOSE(ConvexPlaneManifold, btConvexPlaneCollisionAlgorithm, btPersistentManifold*, m_manifoldPtr)
BTGPU_EXPOSE(ConvexPlaneOwns, btConvexPlaneCollisionAlgorithm, bool, m_ownManifold)
BTGPU_EXPOSE(ConvexConvexManifold, btConvexConvexAlgorithm, btPersistentManifold*, m_manifoldPtr)
BTGPU_EXPOSE(ConvexConvexOwns, btConvexConvexAlgorithm, bool, m_ownManifold)
BTGPU_EXPOSE(ConvexConcaveCallback, btConvexConcaveCollisionAlgorithm, btConvexTriangleCallback,
             m_btConvexTriangleCallback)

// The hash table of the pair cache.
using PairHash = unsigned(unsigned, unsigned);
BTGPU_EXPOSE(PairHashFunction, btHashedOverlappingPairCache, PairHash, getHash)
BTGPU_EXPOSE(PairHashTable, btHashedOverlappingPairCache, btAlignedObjectArray<int>, m_hashTable)
BTGPU_EXPOSE(PairNext, btHashedOverlappingPairCache, btAlignedObjectArray<int>, m_next)

#undef BTGPU_EXPOSE

BTGPU_TRANSLATION_END
