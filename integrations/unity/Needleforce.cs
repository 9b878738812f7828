// SPDX-License-Identifier: Apache-2.0
// The force of a needle in soft tissue, for Unity and .NET: the C library of needleforce, which is next to the program or in Assets/Plugins.
// SI units; force is + when it opposes insertion, depth + inwards from the undeformed surface. A step allocates nothing and does not throw;
// constructors throw a NeedleforceException with what was refused. An object is for one thread at a time.
using System;
using System.Collections;
using System.Collections.Generic;
using System.Globalization;
using System.Linq;
using System.Runtime.InteropServices;

namespace Needleforce {
public sealed class NeedleforceException : Exception {
  public NeedleforceException(string message) : base(message) {}
}
public enum Phase { Free, Deformation, Insertion, Hold, Extraction }
public enum Status { Ok, OutsideRange, InvalidParameter, NotFinite }
/// <summary>What a guard did in a cycle.</summary>
[Flags]
public enum Did { Nothing = 0, Rejected = 1, Stale = 2, Clamped = 4, Slewed = 8, LimitedByEnergy = 16, OutsideBounds = 32 }

/// <summary>Numbers by name: new Numbers { { "max_force", 3.0 } }.</summary>
public class Numbers : IEnumerable {
  internal readonly List<KeyValuePair<string, double>> Given = new List<KeyValuePair<string, double>>();
  public void Add(string name, double value) { Given.Add(new KeyValuePair<string, double>(name, value)); }
  public IEnumerator GetEnumerator() { return Given.GetEnumerator(); }
}
/// <summary>A law by name: new Law("coulomb") { { "per_length", 18.6 } }. Parameters left out have their defaults.</summary>
public sealed class Law : Numbers {
  public readonly string Name;
  public readonly Tip Tip;
  public Law(string name, Tip tip = null) { Name = name; Tip = tip; }
}
/// <summary>A tip, of the law tip_contact alone, by name, or a profile: heights [m] above the apex at radii [m].</summary>
public sealed class Tip : Numbers {
  internal readonly string Name, Equivalence;
  internal readonly double[] Radii, Heights;
  public Tip(string name, string equivalence = null) { Name = name; Equivalence = equivalence; }
  public Tip(double[] radii, double[] heights) { Name = "profile"; Radii = radii; Heights = heights; }
}
public sealed class Layer {
  public double Top;  // [m] where it begins below the undeformed surface
  public Law Stiffness, Puncture, Friction, Cutting, Relaxation;
}

[StructLayout(LayoutKind.Sequential)]
public struct Settings {
  public double MaxSpeed, HoldTime, VelocitySlack, VelocitySlackRatio, BevelHalfAngle, BevelFrictionCoefficient, BevelFaceShare, DepthNoise;
  public static Settings Default { get { Library.Check(); return Native.nf_default_settings_v2(); } }
}
[StructLayout(LayoutKind.Sequential)]
public struct Sample {
  public double Depth, Velocity;                            // [m], [m/s] as accepted
  public double Force, Stiffness, Friction, Cutting;        // [N] the sum and its parts
  public double Lateral, ForceByDepth, ForceByVelocity;     // [N], [N/m], [N s/m]
  public Phase Phase;
  public Status Status;
  int contact, punctured, exit;
  public bool Contact { get { return contact != 0; } }      // these three in one step alone
  public bool Punctured { get { return punctured != 0; } }
  public bool Exit { get { return exit != 0; } }
}
[StructLayout(LayoutKind.Sequential)]
public struct Output {
  public double Force;            // [N] for the device, + opposes insertion
  public double Energy, Reserve;  // [J] the user has put in so far; may still take out
  public Did Did;
  public Sample Sample;           // of the tissue
}
[StructLayout(LayoutKind.Sequential)]
public struct Vector { public double X, Y, Z; }
[StructLayout(LayoutKind.Sequential)]
public struct Base { public double Depth, LateralX, LateralY, TiltX, TiltY, Roll; }  // [m], [rad], the roll not wrapped
[StructLayout(LayoutKind.Sequential)]
public struct Bent {
  public Vector Tip, Tangent;                  // [m], a unit vector
  public Vector BaseForce, BaseMoment;         // [N], [N m] of the tissue on the needle at the base, in its frame
  public double Force, Lateral, Unsupported;   // [N] along the axis; [N] across, on the tip; [m] between base and surface
  public Sample Axial;
  public Status Status;
  int buckled;
  public bool Buckled { get { return buckled != 0; } }
}
[StructLayout(LayoutKind.Sequential)]
public struct BaseOutput {
  public Base Force;              // [N], [N m] for the device, + opposes each coordinate
  public double Energy, Reserve;  // [J] as of Output, along all coordinates
  public Did Did;
  public Bent Sample;             // of the tissue
}
[StructLayout(LayoutKind.Sequential)]
public struct Section { public double End, Stiffness, Curvature; }  // [m] from the tip, EI [N m^2], [1/m] unloaded
/// <summary>A layer across the needle: { "top", 0 }, { "modulus", 2e4 } ...; its form: linear, cubic, hyperbolic or tanh.</summary>
public sealed class LateralLayer : Numbers {
  internal readonly string Form;
  public LateralLayer(string form = null) { Form = form; }
}
/// <summary>A needle that bends and what holds it; Lengths are needle_length, guide_distance, bevel_length ... by name.</summary>
public sealed class Bending {
  public LateralLayer[] Layers;
  public Section[] Sections;
  public Numbers Lengths = new Numbers();
  public int Elements;  // along the embedded needle; 0: 40
}

public static class Library {
  public const int AbiVersion = 2;  // of the C library that this file is for
  static bool good;
  public static string Version { get { Check(); return Marshal.PtrToStringAnsi(Native.nf_version()); } }

  /// <summary>Throws if the C library is missing, or another than this file is for. Every constructor calls it.</summary>
  public static void Check() {
    if (good) return;
    if (IntPtr.Size != 8) throw new NeedleforceException("needleforce needs a process of 64 bits: build for x86_64 or ARM64.");
    int number = Number();
    if (number != AbiVersion)
      throw new NeedleforceException("the C library has ABI " + number + ", and Needleforce.cs is for ABI " + AbiVersion +
                                     ": take both from the same version of needleforce.");
    good = true;
  }
  static int Number() {
    try {
      return Native.nf_abi_version();
    } catch (Exception missing) when (missing is DllNotFoundException || missing is BadImageFormatException) {
      throw new NeedleforceException("the C library was not found, or is for another processor than " + RuntimeInformation.ProcessArchitecture +
                                     ": put needleforce.dll (Windows), libneedleforce.dylib (macOS) or libneedleforce.so (Linux) into " +
                                     "Assets/Plugins, without Unity next to the program.");
    } catch (EntryPointNotFoundException) {
      throw new NeedleforceException("the C library has no number of its ABI, it is older than Needleforce.cs: take both from the " +
                                     "same version of needleforce.");
    }
  }
}

/// <summary>An object of the C library in memory of its own, which Dispose frees.</summary>
public abstract class NativeObject : SafeHandle {
  protected NativeObject(Func<UIntPtr> size) : base(IntPtr.Zero, true) {
    Library.Check();
    SetHandle(Marshal.AllocHGlobal((IntPtr)(long)(ulong)size()));
  }
  public override bool IsInvalid { get { return handle == IntPtr.Zero; } }
  protected override bool ReleaseHandle() { Marshal.FreeHGlobal(handle); return true; }
  internal delegate IntPtr Init(IntPtr memory, Arena arena, out Fault why);
  internal void Make(Init init) {
    using (Arena arena = new Arena()) {
      Fault why;
      if (init(handle, arena, out why) != IntPtr.Zero) return;
      Dispose();
      throw new NeedleforceException(why.Message);
    }
  }
}
/// <summary>One that remembers what the needle did.</summary>
public abstract class Remembering : NativeObject {
  internal delegate int Move(NativeObject self, byte[] bytes, UIntPtr size);
  readonly Action<NativeObject> reset;
  readonly Move save, restore;
  readonly int bytesOfMemory;
  internal Remembering(Func<UIntPtr> size, Action<NativeObject> reset, Func<UIntPtr> saved, Move save, Move restore) : base(size) {
    this.reset = reset;
    this.save = save;
    this.restore = restore;
    bytesOfMemory = (int)(ulong)saved();
  }
  /// <summary>Back to before the first contact.</summary>
  public void Reset() { reset(this); }
  public byte[] Snapshot() {
    byte[] bytes = new byte[bytesOfMemory];
    save(this, bytes, (UIntPtr)(ulong)bytes.Length);
    return bytes;
  }
  /// <summary>False, and nothing changes, for bytes of another version or model, or altered ones.</summary>
  public bool Restore(byte[] bytes) { return bytes != null && restore(this, bytes, (UIntPtr)(ulong)bytes.Length) != 0; }
}

/// <summary>What a step takes where no velocity is measured: the change of depth.</summary>
public static class No { public const double Velocity = double.MaxValue; }

/// <summary>A needle going in and out of up to eight layers, from the surface down.</summary>
public sealed class Insertion : Remembering {
  public Insertion(params Layer[] layers) : this(layers, Settings.Default) {}
  public Insertion(Layer[] layers, Settings settings)
    : base(Native.nf_size, Native.nf_reset, Native.nf_snapshot_size, Native.nf_snapshot, Native.nf_restore) {
    Make((IntPtr memory, Arena arena, out Fault why) => Native.nf_init_v2(
      memory, Native.nf_size(), arena.Layers(layers), Arena.Count(layers), ref settings, out why));
  }
  /// <summary>One cycle: depth [m], velocity [m/s] or No.Velocity, time since the last step [s].</summary>
  public Sample Step(double depth, double velocity, double dt) { Native.nf_step_v2(this, depth, velocity, dt, out Sample sample); return sample; }
}

/// <summary>The same in a solid that was condensed onto the path, as Tissue.condense of the Python package gives it.</summary>
public sealed class Solid : Remembering {
  public Solid(Layer[] layers, Settings settings, double spacing, double[] compliance)
    : base(Native.nf_solid_size, Native.nf_solid_reset, Native.nf_solid_snapshot_size, Native.nf_solid_snapshot, Native.nf_solid_restore) {
    ulong nodes = (ulong)Math.Round(Math.Sqrt(compliance.Length));
    if (nodes * nodes != (ulong)compliance.Length)
      throw new NeedleforceException("compliance has " + compliance.Length + " numbers, no square: give nodes x nodes, row by row.");
    Make((IntPtr memory, Arena arena, out Fault why) => Native.nf_solid_init_v2(
      memory, Native.nf_solid_size(), arena.Layers(layers), Arena.Count(layers), ref settings, spacing, (UIntPtr)nodes, compliance, out why));
  }
  public Sample Step(double depth, double velocity, double dt) { Native.nf_solid_step_v2(this, depth, velocity, dt, out Sample sample); return sample; }
  public double Tip { get { return Native.nf_solid_tip(this); } }  // [m] along the path, in the undeformed tissue
  public double[] Forces() { return Native.Filled(this, Native.nf_solid_forces, 1); }                // [N] at the nodes
  public double[] Displacements() { return Native.Filled(this, Native.nf_solid_displacements, 1); }  // [m]
}

/// <summary>A needle that bends: motion of its base in; tip, shape and forces out. `axial` is copied.</summary>
public sealed class FlexibleInsertion : Remembering {
  delegate IntPtr Along(IntPtr memory, UIntPtr size, NativeObject axial, IntPtr bending, out Fault why);
  public FlexibleInsertion(Insertion axial, Bending bending) : this(axial, bending, Native.nf_bend_init_v2) {}
  public FlexibleInsertion(Solid axial, Bending bending) : this(axial, bending, Native.nf_bend_init_in_solid_v2) {}
  FlexibleInsertion(NativeObject axial, Bending bending, Along init)
    : base(Native.nf_bend_size, Native.nf_bend_reset, Native.nf_bend_snapshot_size, Native.nf_bend_snapshot, Native.nf_bend_restore) {
    Make((IntPtr memory, Arena arena, out Fault why) => init(memory, Native.nf_bend_size(), axial, arena.Bending(bending), out why));
  }
  public Bent Step(Base at, double dt) { Native.nf_bend_step_v2(this, ref at, dt, out Bent bent); return bent; }
  /// <summary>x, y, z of each point from the base to the tip [m].</summary>
  public double[] Shape() { return Native.Filled(this, Native.nf_bend_shape, 3); }
}

/// <summary>Between a needle and a device: limits by name, such as max_force, stale_after, fall_time; those left out are off.</summary>
public abstract class AnyGuard : NativeObject {
  internal delegate IntPtr Around(IntPtr memory, UIntPtr size, NativeObject needle, IntPtr limits, UIntPtr count, out Fault why);
  readonly NativeObject needle;  // is stepped by the guard, and lives as long
  readonly bool held;
  internal AnyGuard(Func<UIntPtr> size, NativeObject needle, Numbers limits, Around init) : base(size) {
    needle.DangerousAddRef(ref held);
    this.needle = needle;
    Make((IntPtr memory, Arena arena, out Fault why) => init(
      memory, size(), needle, arena.List(limits), (UIntPtr)(ulong)limits.Given.Count, out why));
  }
  protected override bool ReleaseHandle() { if (held) needle.DangerousRelease(); return base.ReleaseHandle(); }
}
public sealed class Guard : AnyGuard {
  public Guard(Insertion insertion, Numbers limits) : base(Native.nf_guard_size, insertion, limits, Native.nf_guard_init_v2) {}
  public Guard(Solid solid, Numbers limits) : base(Native.nf_guard_size, solid, limits, Native.nf_guard_init_in_solid_v2) {}
  public Output Step(double depth, double velocity, double dt) { Native.nf_guard_step_v2(this, depth, velocity, dt, out Output output); return output; }
  /// <summary>A cycle without a measurement.</summary>
  public Output Miss(double dt) { Native.nf_guard_miss_v2(this, dt, out Output output); return output; }
  public void Reset() { Native.nf_guard_reset(this); }
}
/// <summary>The same around a needle that bends: one account of energy for all coordinates of its base.</summary>
public sealed class BaseGuard : AnyGuard {
  public BaseGuard(FlexibleInsertion needle, Numbers limits) : base(Native.nf_base_guard_size, needle, limits, Native.nf_base_guard_init_v2) {}
  public BaseOutput Step(Base at, double dt) { Native.nf_base_guard_step_v2(this, ref at, dt, out BaseOutput output); return output; }
  /// <summary>A cycle without a measurement.</summary>
  public BaseOutput Miss(double dt) { Native.nf_base_guard_miss_v2(this, dt, out BaseOutput output); return output; }
  public void Reset() { Native.nf_base_guard_reset(this); }
}

[StructLayout(LayoutKind.Sequential)]
struct Fault {
  UIntPtr layer;
  IntPtr law, quantity, reason;
  double value, low, high;
  static string Text(IntPtr text) { return Marshal.PtrToStringAnsi(text) ?? ""; }
  internal string Message {
    get {
      string range = low != 0 || high != 0 ? ": " + Shown(low) + " to " + Shown(high) : "";
      return "layer " + ((ulong)layer + 1) + ", " + Text(law) + " " + Text(quantity) + " (" + Shown(value) + ") " + Text(reason) + range +
             ". `needleforce laws` lists names, ranges and defaults.";
    }
  }
  static string Shown(double number) { return number.ToString("G6", CultureInfo.InvariantCulture); }
}

/// <summary>Structs of the C library while an object is made; the offsets are those of bindings/c/abi_v2.txt.</summary>
sealed class Arena : IDisposable {
  const int LayerSize = 1048, LawSize = 208, TipSize = 168, LateralSize = 136, BendingSize = 56, PairSize = 16;
  readonly List<IntPtr> blocks = new List<IntPtr>();
  public void Dispose() { foreach (IntPtr block in blocks) Marshal.FreeHGlobal(block); }
  internal static UIntPtr Count(Array items) { return (UIntPtr)(ulong)(items == null ? 0 : items.Length); }

  IntPtr Freed(IntPtr block) { blocks.Add(block); return block; }  // with the others
  IntPtr Zeros(int size) {
    IntPtr block = Freed(Marshal.AllocHGlobal(Math.Max(size, 8)));
    Marshal.Copy(new byte[size], 0, block, size);
    return block;
  }
  IntPtr Text(string text) { return text == null ? IntPtr.Zero : Freed(Marshal.StringToHGlobalAnsi(text)); }
  internal IntPtr Doubles(double[] values) {
    if (values == null) return IntPtr.Zero;
    IntPtr block = Zeros(8 * values.Length);
    Marshal.Copy(values, 0, block, values.Length);
    return block;
  }
  static void Double(IntPtr block, int at, double value) { Marshal.WriteInt64(block, at, BitConverter.DoubleToInt64Bits(value)); }
  void Pairs(IntPtr block, int at, Numbers numbers, int room, string owner) {
    if (numbers.Given.Count > room)
      throw new NeedleforceException(owner + " has " + numbers.Given.Count + " parameters, at most " + room + " have room: give each once.");
    foreach (KeyValuePair<string, double> each in numbers.Given) {
      Marshal.WriteIntPtr(block, at, Text(each.Key));
      Double(block, at + 8, each.Value);
      at += PairSize;
    }
  }
  internal IntPtr List(Numbers numbers) {
    IntPtr block = Zeros(PairSize * numbers.Given.Count);
    Pairs(block, 0, numbers, numbers.Given.Count, "");
    return block;
  }
  internal IntPtr Layers(Layer[] layers) {
    if (layers == null) return IntPtr.Zero;
    IntPtr block = Zeros(LayerSize * layers.Length);
    for (int i = 0; i < layers.Length; ++i) {
      Layer each = layers[i] ?? new Layer();
      Double(block, LayerSize * i, each.Top);
      Law[] laws = { each.Stiffness, each.Puncture, each.Friction, each.Cutting, each.Relaxation };
      for (int k = 0; k < laws.Length; ++k) if (laws[k] != null) Put(block, LayerSize * i + 8 + LawSize * k, laws[k]);
    }
    return block;
  }
  void Put(IntPtr block, int at, Law law) {
    Marshal.WriteIntPtr(block, at, Text(law.Name));
    Pairs(block, at + 8, law, 12, law.Name);
    if (law.Tip != null) Marshal.WriteIntPtr(block, at + 200, Put(law.Tip));
  }
  IntPtr Put(Tip tip) {
    IntPtr block = Zeros(TipSize);
    Marshal.WriteIntPtr(block, 0, Text(tip.Name));
    Pairs(block, 8, tip, 8, tip.Name);
    Marshal.WriteIntPtr(block, 136, Text(tip.Equivalence));
    if (tip.Radii == null || tip.Heights == null || tip.Radii.Length != tip.Heights.Length) return block;
    Marshal.WriteIntPtr(block, 144, Doubles(tip.Radii));
    Marshal.WriteIntPtr(block, 152, Doubles(tip.Heights));
    Marshal.WriteInt64(block, 160, tip.Radii.Length);
    return block;
  }
  internal IntPtr Bending(Bending bending) {
    IntPtr block = Zeros(BendingSize);
    IntPtr layers = Zeros(LateralSize * bending.Layers.Length);
    for (int i = 0; i < bending.Layers.Length; ++i) {
      Pairs(layers, LateralSize * i, bending.Layers[i], 8, "a lateral layer");
      Marshal.WriteIntPtr(layers, LateralSize * i + 128, Text(bending.Layers[i].Form));
    }
    double[] sections = bending.Sections.SelectMany(each => new[] { each.End, each.Stiffness, each.Curvature }).ToArray();
    IntPtr[] members = { layers, (IntPtr)bending.Layers.Length, Doubles(sections), (IntPtr)bending.Sections.Length, List(bending.Lengths),
                         (IntPtr)bending.Lengths.Given.Count };
    Marshal.Copy(members, 0, block, members.Length);
    Marshal.WriteInt32(block, 48, bending.Elements);
    return block;
  }
}

/// <summary>The functions of the C library; those with a struct have its version in their names.</summary>
static class Native {
  const string C = "needleforce";
  [DllImport(C)] internal static extern int nf_abi_version();
  [DllImport(C)] internal static extern IntPtr nf_version();
  [DllImport(C)] internal static extern Settings nf_default_settings_v2();
  [DllImport(C)] internal static extern UIntPtr nf_size();
  [DllImport(C)] internal static extern IntPtr nf_init_v2(IntPtr memory, UIntPtr size, IntPtr layers, UIntPtr count, ref Settings settings, out Fault why);
  [DllImport(C)] internal static extern void nf_step_v2(NativeObject self, double depth, double velocity, double dt, out Sample sample);
  [DllImport(C)] internal static extern void nf_reset(NativeObject self);
  [DllImport(C)] internal static extern UIntPtr nf_snapshot_size();
  [DllImport(C)] internal static extern int nf_snapshot(NativeObject self, [Out] byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern int nf_restore(NativeObject self, byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern UIntPtr nf_solid_size();
  [DllImport(C)] internal static extern IntPtr nf_solid_init_v2(IntPtr memory, UIntPtr size, IntPtr layers, UIntPtr count, ref Settings settings, double spacing, UIntPtr nodes, double[] compliance, out Fault why);
  [DllImport(C)] internal static extern void nf_solid_step_v2(NativeObject self, double depth, double velocity, double dt, out Sample sample);
  [DllImport(C)] internal static extern UIntPtr nf_solid_forces(NativeObject self, [Out] double[] forces, UIntPtr count);
  [DllImport(C)] internal static extern UIntPtr nf_solid_displacements(NativeObject self, [Out] double[] displacements, UIntPtr count);
  [DllImport(C)] internal static extern double nf_solid_tip(NativeObject self);
  [DllImport(C)] internal static extern void nf_solid_reset(NativeObject self);
  [DllImport(C)] internal static extern UIntPtr nf_solid_snapshot_size();
  [DllImport(C)] internal static extern int nf_solid_snapshot(NativeObject self, [Out] byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern int nf_solid_restore(NativeObject self, byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern UIntPtr nf_bend_size();
  [DllImport(C)] internal static extern IntPtr nf_bend_init_v2(IntPtr memory, UIntPtr size, NativeObject axial, IntPtr bending, out Fault why);
  [DllImport(C)] internal static extern IntPtr nf_bend_init_in_solid_v2(IntPtr memory, UIntPtr size, NativeObject axial, IntPtr bending, out Fault why);
  [DllImport(C)] internal static extern void nf_bend_step_v2(NativeObject self, ref Base at, double dt, out Bent bent);
  [DllImport(C)] internal static extern UIntPtr nf_bend_shape(NativeObject self, [Out] double[] points, UIntPtr count);
  [DllImport(C)] internal static extern void nf_bend_reset(NativeObject self);
  [DllImport(C)] internal static extern UIntPtr nf_bend_snapshot_size();
  [DllImport(C)] internal static extern int nf_bend_snapshot(NativeObject self, [Out] byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern int nf_bend_restore(NativeObject self, byte[] bytes, UIntPtr size);
  [DllImport(C)] internal static extern UIntPtr nf_guard_size();
  [DllImport(C)] internal static extern IntPtr nf_guard_init_v2(IntPtr memory, UIntPtr size, NativeObject insertion, IntPtr settings, UIntPtr count, out Fault why);
  [DllImport(C)] internal static extern IntPtr nf_guard_init_in_solid_v2(IntPtr memory, UIntPtr size, NativeObject solid, IntPtr settings, UIntPtr count, out Fault why);
  [DllImport(C)] internal static extern void nf_guard_step_v2(NativeObject self, double depth, double velocity, double dt, out Output output);
  [DllImport(C)] internal static extern void nf_guard_miss_v2(NativeObject self, double dt, out Output output);
  [DllImport(C)] internal static extern void nf_guard_reset(NativeObject self);
  [DllImport(C)] internal static extern UIntPtr nf_base_guard_size();
  [DllImport(C)] internal static extern IntPtr nf_base_guard_init_v2(IntPtr memory, UIntPtr size, NativeObject needle, IntPtr settings, UIntPtr count, out Fault why);
  [DllImport(C)] internal static extern void nf_base_guard_step_v2(NativeObject self, ref Base at, double dt, out BaseOutput output);
  [DllImport(C)] internal static extern void nf_base_guard_miss_v2(NativeObject self, double dt, out BaseOutput output);
  [DllImport(C)] internal static extern void nf_base_guard_reset(NativeObject self);

  internal delegate UIntPtr Fill(NativeObject self, double[] numbers, UIntPtr count);
  /// <summary>As many rows of `width` numbers as the function reports.</summary>
  internal static double[] Filled(NativeObject self, Fill fill, int width) {
    ulong rows = (ulong)fill(self, null, UIntPtr.Zero);
    double[] numbers = new double[(int)rows * width];
    fill(self, numbers, (UIntPtr)rows);
    return numbers;
  }
}
}  // namespace Needleforce
