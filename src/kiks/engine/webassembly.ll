; What Numba and LLVM call that is in no kernel, for modules of kiks/engine/webassembly.py.

%info = type { i64, ptr, ptr, ptr, i64, ptr }
@heap = global i32 0

; Kernels ask for little memory, and the caller puts the heap back when they return.
define void @set_heap(i32 %address) {
  store i32 %address, ptr @heap
  ret void
}

define noalias ptr @NRT_MemInfo_alloc_aligned(i64 %size, i32 %align) {
  %free = load i32, ptr @heap
  %above = add i32 %free, 63
  %begin = and i32 %above, -64
  %data = add i32 %begin, 64
  %bytes = trunc i64 %size to i32
  %end = add i32 %data, %bytes
  store i32 %end, ptr @heap
  %info = inttoptr i32 %begin to ptr
  store i64 1, ptr %info
  %destructor = getelementptr %info, ptr %info, i32 0, i32 1
  store ptr null, ptr %destructor
  %place = getelementptr %info, ptr %info, i32 0, i32 3
  %address = inttoptr i32 %data to ptr
  store ptr %address, ptr %place
  %length = getelementptr %info, ptr %info, i32 0, i32 4
  store i64 %size, ptr %length
  ret ptr %info
}

define void @NRT_MemInfo_call_dtor(ptr %info) {
  ret void
}

; The strides of an array without gaps in another shape: kernels reshape no other one.
define i32 @numba_attempt_nocopy_reshape(
  i64 %n, ptr %shape, ptr %strides, i64 %count, ptr %new_shape, ptr %new_strides, i64 %size, i32 %is_fortran
) {
entry:
  br label %next
next:
  %left = phi i64 [ %count, %entry ], [ %place, %step ]
  %stride = phi i64 [ %size, %entry ], [ %wider, %step ]
  %is_done = icmp eq i64 %left, 0
  br i1 %is_done, label %done, label %step
step:
  %place = sub i64 %left, 1
  %stride_at = getelementptr i64, ptr %new_strides, i64 %place
  store i64 %stride, ptr %stride_at
  %length_at = getelementptr i64, ptr %new_shape, i64 %place
  %length = load i64, ptr %length_at
  %wider = mul i64 %stride, %length
  br label %next
done:
  ret i32 1
}

; x times 2 to the power of n, where neither x nor the result is subnormal, infinite or NaN.
define double @numba_ldexp(double %x, i32 %n) {
  %bits = bitcast double %x to i64
  %wide = sext i32 %n to i64
  %shift = shl i64 %wide, 52
  %sum = add i64 %bits, %shift
  %is_zero = fcmp oeq double %x, 0.0
  %scaled = bitcast i64 %sum to double
  %y = select i1 %is_zero, double %x, double %scaled
  ret double %y
}

; The mantissa from 0.5 to 1 and the exponent of a number that is neither 0, subnormal, infinite nor NaN.
define double @numba_frexp(double %x, ptr %exponent) {
  %bits = bitcast double %x to i64
  %high = lshr i64 %bits, 52
  %biased = and i64 %high, 2047
  %wide = sub i64 %biased, 1022
  %power = trunc i64 %wide to i32
  store i32 %power, ptr %exponent
  %rest = and i64 %bits, -9218868437227405313
  %half = or i64 %rest, 4602678819172646912
  %y = bitcast i64 %half to double
  ret double %y
}

; All 128 bits of a product. It must not be optimized, which would make it call itself. It stays without a caller, as
; LLVM writes calls of it at the very end.
@llvm.compiler.used = appending global [1 x ptr] [ptr @__multi3], section "llvm.metadata"
define void @__multi3(ptr %out, i64 %a, i64 %a_high, i64 %b, i64 %b_high) noinline optnone {
  %al = and i64 %a, 4294967295
  %ah = lshr i64 %a, 32
  %bl = and i64 %b, 4294967295
  %bh = lshr i64 %b, 32
  %ll = mul i64 %al, %bl
  %lh = mul i64 %al, %bh
  %hl = mul i64 %ah, %bl
  %hh = mul i64 %ah, %bh
  %carry = lshr i64 %ll, 32
  %middle = add i64 %hl, %carry
  %middle_low = and i64 %middle, 4294967295
  %middle_high = lshr i64 %middle, 32
  %other = add i64 %lh, %middle_low
  %other_high = lshr i64 %other, 32
  %low = mul i64 %a, %b
  %cross1 = mul i64 %a, %b_high
  %cross2 = mul i64 %a_high, %b
  %h1 = add i64 %hh, %middle_high
  %h2 = add i64 %h1, %other_high
  %h3 = add i64 %h2, %cross1
  %high = add i64 %h3, %cross2
  store i64 %low, ptr %out
  %place = getelementptr i64, ptr %out, i32 1
  store i64 %high, ptr %place
  ret void
}
