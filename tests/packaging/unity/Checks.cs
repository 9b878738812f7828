// SPDX-License-Identifier: Apache-2.0
// Prints what test_unity.py asserts: a line each.
using System;
using System.Globalization;
using Needleforce;

static class Checks {
  static Law Friction(double perLength) { return new Law("coulomb") { { "per_length", perLength } }; }
  static Layer Layer(double perLength) {
    return new Layer {
      Stiffness = new Law("cone") { { "reduced_modulus", 117546 }, { "half_angle", 0.2618 } }, Friction = Friction(perLength),
      Puncture = new Law("puncture_depth") { { "depth", 3.2e-3 } }, Cutting = new Law("constant_cutting") { { "force", 0.0776 } },
    };
  }
  static void Refused(Action make) {
    try {
      make();
    } catch (Exception error) {
      Console.WriteLine(error.GetType().Name + ": " + error.Message.Replace("\n", " "));
    }
  }
  static Output Driven(Guard guard, double depth) {
    Output output = default(Output);
    for (int i = 1; i <= 4000; ++i) output = guard.Step(depth * i / 4000, No.Velocity, 1e-3);
    return output;
  }
  static void Guarded(Insertion insertion) {
    Guard guard = new Guard(insertion, new Numbers { { "max_force", 0.15 }, { "stale_after", 5e-3 }, { "fall_time", 20e-3 } });
    insertion.Dispose();  // lives as long as its guard
    Output output = Driven(guard, 8e-3);
    Console.WriteLine("guarded {0} {1} of {2:F4}", output.Force, output.Did, output.Sample.Force);
    for (int i = 0; i < 24; ++i) guard.Miss(1e-3);
    output = guard.Miss(1e-3);
    Console.WriteLine("missed {0} {1}", output.Force, output.Did);
    guard.Dispose();
    Refused(() => guard.Step(0, 0, 1e-3));
  }
  static void GuardedBase() {
    Bending straight = new Bending {
      Layers = new[] { new LateralLayer { { "top", 0 }, { "modulus", 2e4 } } }, Sections = new[] { new Section { Stiffness = 0.02 } },
      Lengths = new Numbers { { "needle_length", 0.15 } },
    };
    FlexibleInsertion needle = new FlexibleInsertion(new Insertion(Layer(18.6)), straight);
    BaseGuard guard = new BaseGuard(needle, new Numbers { { "max_force", 0.15 }, { "stale_after", 5e-3 }, { "fall_time", 20e-3 } });
    needle.Dispose();
    BaseOutput output = default(BaseOutput);
    for (int i = 1; i <= 4000; ++i) output = guard.Step(new Base { Depth = 2e-6 * i, Roll = 0.1 }, 1e-3);
    Console.WriteLine("base {0} {1} {2} of {3:F4}", output.Force.Depth, output.Force.LateralX, output.Did, output.Sample.Force);
    for (int i = 0; i < 25; ++i) output = guard.Miss(1e-3);
    Console.WriteLine("base missed {0} {1}", output.Force.Depth, output.Did);
    guard.Reset();
    Console.WriteLine("base reset {0} {1}", guard.Step(default(Base), 1e-3).Force.Depth, guard.Step(new Base { Depth = double.NaN }, 1e-3).Did);
    Refused(() => new BaseGuard(new FlexibleInsertion(new Insertion(Layer(18.6)), straight), new Numbers { { "max_torque", 1.0 } }));
  }
  static void Main() {
    CultureInfo.CurrentCulture = CultureInfo.InvariantCulture;
    Guarded(new Insertion(Layer(18.6)));
    GuardedBase();
    Insertion insertion = new Insertion(Layer(18.6));
    insertion.Step(1e-3, No.Velocity, 1e-3);
    Sample odd = insertion.Step(double.NaN, No.Velocity, 1e-3);
    Console.WriteLine("nan {0} {1}", odd.Force, odd.Status);
    Refused(() => new Insertion(Layer(18.6), Layer(-1.0)));
    Refused(() => new Insertion(new Layer { Stiffness = new Law("conus") }));
    Refused(() => new Insertion());
    Refused(() => new Insertion(new Layer[9]));
    Law crowded = Friction(1.0);
    for (int i = 0; i < 12; ++i) crowded.Add("presliding", 2e-5);
    Refused(() => new Insertion(new Layer { Friction = crowded }));
    Refused(() => new Guard(insertion, new Numbers { { "max_forse", 1.0 } }));
    long before = GC.CollectionCount(0);
    for (int i = 0; i < 2000000; ++i) insertion.Step(1e-3, 0.0, 1e-3);
    Console.WriteLine("collections {0}", GC.CollectionCount(0) - before);
    Component();
  }
  static void Component() {
    NeedleInTissue needle = new NeedleInTissue { surface = new UnityEngine.Transform(), body = new UnityEngine.Rigidbody() };
    needle.surface.forward.Z = -1f;  // out of the tissue
    needle.transform.forward.Z = 1f;
    Call(needle, "OnEnable");
    for (int i = 0; i <= 4000; ++i) {
      needle.transform.position.Z = 2e-6f * i;
      Call(needle, "FixedUpdate");
    }
    Console.WriteLine("component {0:F4} {1:F4} {2}", needle.force, needle.body.Force.Z, needle.status);
    Call(needle, "OnDisable");
  }
  static void Call(NeedleInTissue needle, string method) {
    needle.GetType().GetMethod(method, System.Reflection.BindingFlags.Instance | System.Reflection.BindingFlags.NonPublic).Invoke(needle, null);
  }
}
