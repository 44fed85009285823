// SPDX-License-Identifier: Zlib
// SPDX-FileCopyrightText: 2026 The btgpu authors
// Contact manifolds between the device and Bullet's dispatcher: read when a world comes from the stock path, written
// when it goes there, so that no accumulated impulse is lost on the way.
#pragma once

#include "read_world.h"

BTGPU_TRANSLATION_BEGIN

// One contact point each way. Combined material values are copied, user data is left alone.
ContactPoint readContactPoint(const btManifoldPoint& point);
void writeContactPoint(const ContactPoint& from, const btTransform& a, const btTransform& b, btManifoldPoint& point);

Manifold readManifold(const btPersistentManifold& from, std::uint32_t bodyA, std::uint32_t bodyB);

// The dispatcher's manifolds between objects that the reader knows and the device collides, in the order and form that
// WorldInput wants. Without those of `predictive`, which last for one step.
std::vector<Manifold> readManifolds(btDispatcher& dispatcher, const WorldReader& reader,
                                    const btManifoldArray& predictive);

// Makes `manifold` hold exactly these points; user data stays at its index, and points beyond those that were there
// have none. Nobody is told of points that are gone.
void fillManifold(const Manifold& from, btPersistentManifold& manifold);

// The same, and gContactDestroyedCallback is told of the points beyond.
void writeManifold(const Manifold& from, btPersistentManifold& manifold);

// Tells the points of a manifold what they lie on, as Bullet's setShapeIdentifiers does: which shapes of compounds
// (m_index0, m_index1) or, on a mesh, which is always the second one and may be of a compound too, which triangles
// (m_partId1, m_index1). `key`: of the slots.
void nameShapes(const Manifold& from, const WorldReader& reader, ulong key, btPersistentManifold& manifold);

// Puts the device's manifolds (of slots: Engine::readManifolds) into the dispatcher, each into the algorithm of its
// pair, which is created if need be. The host's broadphase must be current: pairs that it does not have are left out.
void writeManifolds(const std::vector<Manifold>& manifolds, const WorldReader& reader, btCollisionWorld& world);

// The manifold of a pair of objects, created with its algorithm if there is none; null if they don't collide.
btPersistentManifold* manifoldOfPair(btCollisionWorld& world, btCollisionObject& a, btCollisionObject& b);

BTGPU_TRANSLATION_END
