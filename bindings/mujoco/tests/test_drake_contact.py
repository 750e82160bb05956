"""The parameters of Drake's hydroelastic contact that `fingerpad export --format drake-hydroelastic-json` wrote: a sphere with them has the depth and the
torsional limit that the file states, in Drake. A test of the program holds that the files are what it writes."""

import json
import pathlib

import pytest

HERE = pathlib.Path(__file__).resolve().parent
pytestmark = pytest.mark.nightly


def pressed(stated, load_n, torque_n_m):
    """Depth, mm, of the sphere on a rigid half space after a second, and its spin, rad/s, after 0.3 s more under the torque."""
    pytest.importorskip("pydrake")
    from pydrake.geometry import AddCompliantHydroelasticProperties, AddContactMaterial, AddRigidHydroelasticProperties, HalfSpace, ProximityProperties, Sphere
    from pydrake.math import RigidTransform
    from pydrake.multibody.math import SpatialForce
    from pydrake.multibody.plant import AddMultibodyPlant, CoulombFriction, ExternallyAppliedSpatialForce, MultibodyPlantConfig
    from pydrake.multibody.tree import SpatialInertia
    from pydrake.systems.analysis import Simulator
    from pydrake.systems.framework import DiagramBuilder

    radius, friction = stated["radius_m"], CoulombFriction(stated["mu"], stated["mu"])
    builder = DiagramBuilder()
    plant, _ = AddMultibodyPlant(MultibodyPlantConfig(time_step=1e-3), builder)
    body = plant.AddRigidBody("tip", SpatialInertia.SolidSphereWithMass(1 / stated["inverse_mass_per_kg"], radius))
    soft, rigid = ProximityProperties(), ProximityProperties()
    AddCompliantHydroelasticProperties(stated["resolution_hint_m"], stated["hydroelastic_modulus_pa"], soft)
    AddContactMaterial(stated["hunt_crossley_dissipation_s_per_m"], None, friction, soft)
    AddRigidHydroelasticProperties(rigid)
    AddContactMaterial(None, None, friction, rigid)
    plant.RegisterCollisionGeometry(body, RigidTransform(), Sphere(radius), "tip", soft)
    plant.RegisterCollisionGeometry(plant.world_body(), RigidTransform(), HalfSpace(), "plate", rigid)
    plant.mutable_gravity_field().set_gravity_vector([0, 0, 0])
    plant.Finalize()
    simulator = Simulator(builder.Build())
    context = plant.GetMyMutableContextFromRoot(simulator.get_mutable_context())
    plant.SetFreeBodyPose(context, body, RigidTransform([0, 0, radius]))

    def apply(torque_n_m, until_s):
        force = ExternallyAppliedSpatialForce()
        force.body_index, force.p_BoBq_B = body.index(), [0, 0, 0]
        force.F_Bq_W = SpatialForce([0, 0, torque_n_m], [0, 0, -load_n])
        plant.get_applied_spatial_force_input_port().FixValue(context, [force])
        simulator.AdvanceTo(until_s)

    apply(0.0, 1.0)
    depth = radius - plant.EvalBodyPoseInWorld(context, body).translation()[2]
    apply(torque_n_m, 1.3)
    return 1e3 * depth, plant.EvalBodySpatialVelocityInWorld(context, body).rotational()[2]


@pytest.mark.parametrize("tip", ["fingertip", "silicone-dome"])
def test_a_sphere_in_drake_has_the_stated_depths_and_torsional_limit(tip):
    stated = json.loads((HERE / f"drake_{tip}.json").read_text())
    there = len(stated["loads_n"]) // 2
    limit_n_m = 1e-3 * stated["torsional_limits_n_mm"][there]
    spins = {}
    for share in (0.95, 1.05):
        depth_mm, spins[share] = pressed(stated, stated["load_n"], share * limit_n_m)
        # The mesh of the sphere lies within it.
        assert depth_mm == pytest.approx(stated["depth_mm"], rel=0.01)
    # Below the limit it creeps within the stiction tolerance; above it speeds up.
    assert 0 < spins[0.95] < 0.05 * spins[1.05] and spins[1.05] > 1, spins
    for at in (0, -1):
        depth_mm, _ = pressed(stated, stated["loads_n"][at], 0.0)
        # Force grows faster than depth, so that a share of force is less in depth.
        assert depth_mm == pytest.approx(stated["depths_mm"][at], rel=0.01 + abs(stated["normal_force_errors"][at]))
